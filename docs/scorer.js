/* How the site's search ranks: where a word means the same on several pages, the one that says how comes before what was
   measured and before the reference. The numbers of Scorer are Sphinx's own. */
const FIRST = /^(how\/|linear-models|choosing-lags|bundles|look-first|design-an-experiment|free-run|evidence|stability|composites|python|sweeps|auto|assemblies|reading-files|files\/)/;
const LAST = /^(measured\/|reference\/|results|gallery\/index|from-jax|from-sysidentpy|rail|index$)/;
var Scorer = {
  score: ([docname, , anchor, , score]) => {
    if (docname === "reference/api" && anchor) return score + 4; // a function of that name
    if (FIRST.test(docname)) return score + 3;
    if (docname === "from-matlab") return score + 2;
    return LAST.test(docname) ? score - 3 : score;
  },
  objNameMatch: 11,
  objPartialMatch: 6,
  objPrio: { 0: 15, 1: 5, 2: -5 },
  objPrioDefault: 0,
  title: 15,
  partialTitle: 7,
  term: 5,
  partialTerm: 2,
};
