// MLflow's page that compares runs has no chart of what they give over their samples. It is given links to its own
// page of metrics, where target and outputs of all these runs are lines in one chart: a link for each case.
(() => {
  const NAME = "sysid-outputs";
  const TARGET = "target/", OUTPUT = "output/";

  async function keysOf(run) {
    const answer = await fetch("ajax-api/2.0/mlflow/runs/get?run_id=" + encodeURIComponent(run));
    const metrics = (await answer.json()).run.data.metrics || [];
    return metrics.map((metric) => metric.key);
  }

  function link(chosen, name) {
    const query = new URLSearchParams({
      runs: chosen.get("runs"),
      metric: JSON.stringify(TARGET + name),
      experiments: chosen.get("experiments") || "[]",
      plot_metric_keys: JSON.stringify([TARGET + name, OUTPUT + name]),
    });
    const made = document.createElement("a");
    made.href = "#/metric?" + query;
    made.textContent = name;
    made.style.cssText = "margin-left: 12px; color: #0e538b";
    return made;
  }

  function bar(links) {
    const made = document.createElement("nav");
    made.id = NAME;
    made.setAttribute("aria-label", "Outputs over the target");
    made.style.cssText =
      "position: fixed; bottom: 16px; left: 50%; transform: translateX(-50%); z-index: 10; max-width: 60vw; " +
      "max-height: 30vh; overflow: auto; padding: 10px 18px; border: 1px solid #8fa6bb; border-radius: 6px; " +
      "background: white; color: #11171c; font: 14px sans-serif; box-shadow: 0 2px 8px #0003";
    const title = document.createElement("strong");
    title.textContent = "Outputs over the target:";
    made.append(title, ...links);
    return made;
  }

  async function show() {
    const here = location.hash;
    document.getElementById(NAME)?.remove();
    const [page, query] = here.split("?");
    if (page !== "#/compare-runs" || !query) return;
    const chosen = new URLSearchParams(query);
    const runs = JSON.parse(chosen.get("runs") || "[]");
    const keys = new Set((await Promise.all(runs.map(keysOf))).flat());
    const cases = [...keys].filter((key) => key.startsWith(OUTPUT)).map((key) => key.slice(OUTPUT.length)).sort();
    if (location.hash !== here || !cases.length) return;
    document.getElementById(NAME)?.remove();
    document.body.append(bar(cases.map((name) => link(chosen, name))));
  }

  // Another version of MLflow may lack the page or its answer: then there is no bar, and all else is as it was.
  let shown = null;
  function tryTo() {
    if (location.hash === shown || !document.body) return;
    shown = location.hash;
    show().catch(() => undefined);
  }
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
