/* What changes between two texts, line by line: [{from, to, insert}]. */

const MOST = 4e6; // pairs of lines that are compared

export function changesBetween(before, after) {
  const old = before.split(/(?<=\n)/), now = after.split(/(?<=\n)/);
  let first = 0, last = 0;
  while (first < old.length && first < now.length && old[first] === now[first]) first += 1;
  while (last < old.length - first && last < now.length - first && old[old.length - 1 - last] === now[now.length - 1 - last]) last += 1;
  const a = old.slice(first, old.length - last), b = now.slice(first, now.length - last);
  const begin = old.slice(0, first).reduce((sum, line) => sum + line.length, 0);
  if (a.length * b.length > MOST) return [{from: begin, to: begin + a.join("").length, insert: b.join("")}];
  const found = [];
  let place = begin, i = 0, j = 0;
  for (const [k, m] of [...kept(a, b), [a.length, b.length]]) {
    const gone = a.slice(i, k).join(""), come = b.slice(j, m).join("");
    if (gone || come) found.push(within(place, gone, come));
    place += gone.length + (k < a.length ? a[k].length : 0);
    i = k + 1;
    j = m + 1;
  }
  return found;
}

/* The longest common lines, as pairs of their numbers. */
function kept(a, b) {
  const wide = b.length + 1, most = new Uint32Array((a.length + 1) * wide);
  for (let i = a.length - 1; i >= 0; i -= 1) {
    for (let j = b.length - 1; j >= 0; j -= 1) {
      most[i * wide + j] = a[i] === b[j] ? most[(i + 1) * wide + j + 1] + 1 : Math.max(most[(i + 1) * wide + j], most[i * wide + j + 1]);
    }
  }
  const pairs = [];
  for (let i = 0, j = 0; i < a.length && j < b.length;) {
    if (a[i] === b[j]) { pairs.push([i, j]); i += 1; j += 1; }
    else if (most[(i + 1) * wide + j] >= most[i * wide + j + 1]) i += 1; else j += 1;
  }
  return pairs;
}

/* Of one passage, only what differs in its middle. */
function within(from, gone, come) {
  let first = 0, last = 0;
  while (first < gone.length && first < come.length && gone[first] === come[first]) first += 1;
  while (last < gone.length - first && last < come.length - first && gone[gone.length - 1 - last] === come[come.length - 1 - last]) last += 1;
  return {from: from + first, to: from + gone.length - last, insert: come.slice(first, come.length - last)};
}
