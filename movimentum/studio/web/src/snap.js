/* Where a pencil goes: to round numbers, level or upright, as long as another rod or in its direction, in line with points. */

const NEAR = 5; // pixels of the page
const NEAR_ANGLE = 3; // degrees

export class Snap {
  constructor(stage) {
    this.stage = stage;
  }

  /* {at, guides, words, exact} of a place; `from`: where the line that is being drawn begins. */
  place(point, from = null, left = []) {
    const {stage} = this, reach = NEAR / stage.view().scale;
    const rods = this.rods(left), step = stage.grid ? stage.gridStep() : 1;
    const plain = point.map((value) => Math.round(value / step) * step);
    if (from) {
      const found = this.along(point, from, rods, reach);
      if (found) return found;
    }
    const guides = [], words = [], at = [...plain];
    for (const axis of [0, 1]) {
      const near = this.points(left).filter((other) => Math.abs(other[axis] - point[axis]) < reach && Math.hypot(other[0] - point[0], other[1] - point[1]) > reach)
        .sort((a, b) => Math.abs(a[axis] - point[axis]) - Math.abs(b[axis] - point[axis]))[0];
      if (!near) continue;
      at[axis] = near[axis];
      guides.push([near, at]);
      words.push(axis === 0 ? "in line" : "level");
    }
    return {at, guides, words: [...new Set(words)], exact: guides.length > 0};
  }

  /* A direction or a length that another rod has; null: none is near. */
  along(point, from, rods, reach) {
    const [dx, dy] = [point[0] - from[0], point[1] - from[1]], length = Math.hypot(dx, dy);
    if (length < 2 * reach) return null;
    const angle = Math.atan2(dy, dx), words = [], guides = [];
    let direction = null, least = NEAR_ANGLE * Math.PI / 180;
    const offer = (other, name, guide) => {
      for (const [turn, kind] of [[0, name], [Math.PI / 2, name === "parallel" ? "square" : null]]) {
        if (!kind) continue;
        let off = (angle - other - turn) % Math.PI;
        if (off > Math.PI / 2) off -= Math.PI;
        if (off < -Math.PI / 2) off += Math.PI;
        if (Math.abs(off) < least) { least = Math.abs(off); direction = {angle: angle - off, kind, guide}; }
      }
    };
    offer(0, "level", null);
    offer(Math.PI / 2, "upright", null);
    if (!direction) for (const [a, b] of rods) offer(Math.atan2(b[1] - a[1], b[0] - a[0]), "parallel", [a, b]);
    let size = length, same = null;
    for (const [a, b] of rods) {
      const other = Math.hypot(b[0] - a[0], b[1] - a[1]);
      if (Math.abs(other - length) < Math.min(reach, Math.abs(size - length) || reach)) { size = other; same = [a, b]; }
    }
    if (!direction && !same) return null;
    const grid = this.stage.grid ? this.stage.gridStep() : 1;
    if (direction) { words.push(direction.kind); if (direction.guide) guides.push(direction.guide); }
    if (same) { words.push("equal"); guides.push(same); } else size = Math.round(size / grid) * grid;
    const final = direction ? direction.angle : angle;
    const at = [from[0] + size * Math.cos(final), from[1] + size * Math.sin(final)].map((value) => Number(value.toFixed(3)));
    guides.push([from, at]);
    return {at, guides, words, exact: true};
  }

  /* The ends of every rod, of which `left` (names of things) are not counted. */
  rods(left) {
    const {stage} = this, found = [];
    if (!stage.scene || !stage.picture) return found;
    stage.scene.things.forEach((thing, number) => {
      const locals = Object.values(thing.anchors);
      if (thing.hidden || !thing.body || left.includes(thing.name) || locals.length < 2) return;
      const ends = locals.slice(0, 2).map((local) => stage.picture.place(number, local, stage.picture.frame));
      if (ends[0] && ends[1] && Math.hypot(ends[1][0] - ends[0][0], ends[1][1] - ends[0][1]) > 1) found.push(ends);
    });
    return found;
  }

  points(left) {
    const {stage} = this;
    return stage.anchors().filter(({thing}) => !stage.scene.things[thing].hidden && !left.includes(stage.scene.things[thing].name)).map(({at}) => at);
  }
}
