// Signals of runs: read from the table that a run is exported to, and thinned to what a screen can show.

const UNITS = [["_rad_per_s", "rad/s"], ["_rad", "rad"], ["_degC", "degC"], ["_Hz", "Hz"], ["_A", "A"], ["_V", "V"], ["_s", "s"], ["_N_m", "N·m"]];

// Return a map from a signal's name to {unit, times, values}, in SI; times and values are arrays of the same length.
export function readTable(text) {
  const lines = text.split("\n");
  const names = lines[0].trim().split(",").slice(1);
  const columns = names.map(() => ({ times: [], values: [] }));
  for (let at = 1; at < lines.length; at += 1) {
    const cells = lines[at].split(",");
    const time = Number(cells[0]);
    for (let column = 1; column < cells.length; column += 1) {
      const cell = cells[column].trim();
      if (cell !== "" && columns[column - 1]) { columns[column - 1].times.push(time); columns[column - 1].values.push(Number(cell)); }
    }
  }
  return new Map(names.map((name, index) => {
    const [end, unit] = UNITS.find(([one]) => name.endsWith(one)) ?? ["", "1"];
    return [name.slice(0, name.length - end.length), { unit, ...columns[index] }];
  }));
}

// Return the place of the last time that is not after `time`, -1 where there is none.
function before(times, time) {
  let low = 0, high = times.length;
  while (low < high) { const middle = (low + high) >> 1; if (times[middle] <= time) low = middle + 1; else high = middle; }
  return low - 1;
}

// Return the latest value at a time, null before the first.
export function valueAt(signal, time) {
  const at = signal ? before(signal.times, time) : -1;
  return at < 0 ? null : signal.values[at];
}

// Return points between two times: all of them, or the lowest and highest of each of `most` parts where there are more.
export function thinned(signal, from, to, most, factor = 1) {
  const first = Math.max(before(signal.times, from), 0), last = Math.min(before(signal.times, to) + 1, signal.times.length - 1);
  const step = Math.max(1, Math.floor((last - first + 1) / most)), points = [];
  for (let start = first; start <= last; start += step) {
    let low = start, high = start;
    for (let at = start; at < start + step && at <= last; at += 1) {
      if (signal.values[at] < signal.values[low]) low = at;
      if (signal.values[at] > signal.values[high]) high = at;
    }
    for (const at of low < high ? [low, high] : low > high ? [high, low] : [low]) points.push([signal.times[at], signal.values[at] * factor]);
  }
  return points;
}
