// What came of a step of a run: which limits were held against its samples, and whether it kept them.

import { measured, say, shown } from "./words.js";

// Return text and class. `kinds` tells of each kind of phase whether its friction is watched, and what is measured in it.
export function stepResult(result, phase, kinds) {
  if (phase.end_s === null) return [`■ ${say("step_broken")}`, "inconclusive"];
  const above = result.exceedances.filter((one) => one.phase === phase.id);
  if (above.length) {
    const worst = above.reduce((one, other) => (other.peak / other.limit > one.peak / one.limit ? other : one));
    return [`✗ ${say("step_fail", { count: above.length, peak: shown(worst.peak, "N·m"), limit: shown(worst.limit, "N·m") })}`, "fail"];
  }
  const kind = kinds?.[phase.name.replaceAll(" ", "_")], isJudged = result.bench.outcome === "ok" && ["pass", "fail"].includes(result.unit.verdict);
  if (!kind || !isJudged) return [say("step_done"), ""];
  const held = result.measurements.filter((one) => one.verdict && kind.measured.some((id) => one.id === id || one.id.startsWith(`${id}_`)));
  const named = (verdict) => held.filter((one) => one.verdict === verdict).map((one) => measured(one.id, one.name)).join(", ");
  if (named("fail")) return [`✗ ${say("step_outside", { names: named("fail") })}`, "fail"];
  if (named("inconclusive")) return [`? ${say("step_undecided", { names: named("inconclusive") })}`, "inconclusive"];
  return kind.is_watched || held.length ? [`✓ ${say("step_pass")}`, "pass"] : [say("step_done"), ""];
}
