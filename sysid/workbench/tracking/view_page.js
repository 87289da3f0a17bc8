// MLflow's list of runs opens without a column of figures, wherever its page is reached from but our own address. An
// experiment that has our view is led on to it, once in a tab: who leaves the view is not brought back.
(() => {
  const KEY = "sysid", SEEN = "sysid.view.seen";
  const PAGE = /^#\/experiments\/(\d+)(?:\/runs)?$/;

  async function lead() {
    const here = location.hash;
    const [page, query] = here.split("?");
    const found = PAGE.exec(page);
    if (!found) return;
    const experiment = found[1], chosen = new URLSearchParams(query || "");
    const seen = new Set(JSON.parse(sessionStorage.getItem(SEEN) || "[]"));
    if (seen.has(experiment)) return;
    sessionStorage.setItem(SEEN, JSON.stringify([...seen, experiment]));
    if (chosen.has("viewStateShareKey")) return;
    const answer = await fetch("ajax-api/2.0/mlflow/experiments/get?experiment_id=" + experiment);
    const tags = (await answer.json()).experiment.tags || [];
    if (!tags.some((tag) => tag.key === "mlflow.sharedViewState." + KEY)) return;
    const now = PAGE.exec(location.hash.split("?")[0]);
    if (!now || now[1] !== experiment) return;
    location.replace("#/experiments/" + experiment + "/runs?viewStateShareKey=" + KEY + "&workflowType=machine_learning");
  }

  // Another version of MLflow may lack the page or its answer: then all is as it was.
  const tryTo = () => void lead().catch(() => undefined);
  ["hashchange", "popstate", "DOMContentLoaded"].forEach((event) => addEventListener(event, tryTo));
  // MLflow goes from page to page without an event.
  for (const name of ["pushState", "replaceState"]) {
    const before = history[name];
    history[name] = function (...given) {
      before.apply(this, given);
      tryTo();
    };
  }
})();
