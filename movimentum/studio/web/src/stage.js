/* The picture: the film's painter with a view of its own, what is laid over it, and what is under the pointer. */
/* global MovimentumPainter */

const HUES = ["#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const BLANK = [0, 0, 640, 480];
const NEAR = 9; // pixels

class Picture extends MovimentumPainter {
  constructor(film, stage) {
    super(film, stage.canvas);
    this.stage = stage;
    this.tracing = true;
    this.unwanted = new Set();
    this.known = new Map();
    this.exact = film.exact ? new Float64Array(Uint8Array.from(atob(film.exact), (c) => c.charCodeAt(0)).buffer) : null;
  }

  pose(index, frame) {
    const held = this.stage.held;
    if (!held) return super.pose(index, frame);
    const [x, y, c, s] = held.slice(4 * this.film.numbers[index], 4 * this.film.numbers[index] + 4);
    const [px, py] = this.film.pivots[index];
    return [x + c * px - s * py, y + s * px + c * py, Math.atan2(s, c) * 180 / Math.PI];
  }

  /* Where a thing's local point is, with all digits where they are known; null where nothing is known. */
  place(number, [x, y], frame) {
    const held = this.stage.held;
    let places = held, from = 4 * number;
    if (!held && this.exact) { places = this.exact; from = 4 * (number * this.film.frames + frame); }
    if (places) {
      const ox = places[from], oy = places[from + 1], c = places[from + 2], s = places[from + 3];
      return [ox + c * x - s * y, oy + s * x + c * y];
    }
    const index = this.film.numbers.indexOf(number);
    if (index < 0) return null;
    const [px, py] = this.film.pivots[index];
    return this.world(index, x - px, y - py, frame);
  }

  /* Springs and texts with numbers are drawn anew where a hand has moved what they are about. */
  symbol(mark) {
    this.moved(mark, (there) => super.symbol(there));
  }

  words(mark) {
    if (this.film.marks.includes(mark)) this.moved(mark, (there) => super.words(there)); else super.words(mark);
  }

  moved(mark, paint) {
    const other = this.stage.held && this.stage.redrawn;
    if (!other) { paint(mark); return; }
    const place = other.live.indexOf(this.film.live[this.film.marks.indexOf(mark)]);
    if (place < 0) return; // it is not seen there
    const {poses, frame} = this;
    this.poses = other.numbers;
    this.frame = 0;
    paint(other.marks[place]);
    this.poses = poses;
    this.frame = frame;
  }

  drawPath(trace, points) {
    if (!this.unwanted.has(trace)) super.drawPath(trace, points);
  }

  lay(context) {
    if (this.copying) { super.lay(context); return; }
    const [left, bottom, right, top] = this.stage.paper();
    this.stage.transform(context);
    context.fillStyle = this.film.background || this.film.paper;
    context.fillRect(left, bottom, right - left, top - bottom);
  }

  draw() {
    if (!this.images || this.stage.picture !== this) return;
    super.draw();
    this.stage.drawOver(this.context);
    this.stage.shown();
  }

  /* The film's own picture on another canvas, without what the page lays over it. */
  paintOn(canvas) {
    const {canvas: own, context} = this;
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
    this.copying = true;
    super.draw();
    this.copying = false;
    this.canvas = own;
    this.context = context;
  }
}

export class Stage {
  constructor(canvas) {
    this.canvas = canvas;
    this.picture = null;
    this.scene = null;
    this.glimpse = false;
    this.under = []; // what else is drawn: functions of the context and a pixel's size in the world
    this.names = false;
    this.arrows = true;
    this.points = false;
    this.held = null;
    this.free = {motions: [], things: []};
    this.lit = new Set();
    this.colored = () => [];
    this.shown = () => {};
    this.hovered = null;
    this.band = null;
    this.userView = null;
    this.frame = 0;
    this.rect = BLANK;
    new ResizeObserver(() => this.resize()).observe(canvas);
    this.resize();
  }

  /* --- the view --- */

  resize() {
    const fine = window.devicePixelRatio || 1;
    this.canvas.width = Math.max(1, Math.round(this.canvas.clientWidth * fine));
    this.canvas.height = Math.max(1, Math.round(this.canvas.clientHeight * fine));
    this.draw();
  }

  paper() {
    return this.rect;
  }

  /* Centre (world) and pixels of the page to a world pixel. */
  view() {
    if (this.userView) return this.userView;
    const [left, bottom, right, top] = this.rect;
    const margin = 12;
    const wide = Math.max(1, this.canvas.clientWidth - 2 * margin), high = Math.max(1, this.canvas.clientHeight - 2 * margin);
    const scale = Math.min(wide / Math.max(1, right - left), high / Math.max(1, top - bottom));
    return {x: (left + right) / 2, y: (bottom + top) / 2, scale};
  }

  transform(context) {
    const {x, y, scale} = this.view();
    const fine = this.canvas.width / Math.max(1, this.canvas.clientWidth);
    const k = fine * scale;
    context.setTransform(k, 0, 0, -k, this.canvas.width / 2 - k * x, this.canvas.height / 2 + k * y);
  }

  /* From the world to the canvas in the page's pixels, and back. */
  local([wx, wy]) {
    const {x, y, scale} = this.view();
    return [this.canvas.clientWidth / 2 + scale * (wx - x), this.canvas.clientHeight / 2 - scale * (wy - y)];
  }

  world([px, py]) {
    const {x, y, scale} = this.view();
    return [x + (px - this.canvas.clientWidth / 2) / scale, y - (py - this.canvas.clientHeight / 2) / scale];
  }

  toScreen(point) {
    const box = this.canvas.getBoundingClientRect();
    const [x, y] = this.local(point);
    return [box.left + window.scrollX + x, box.top + window.scrollY + y];
  }

  fromEvent(event) {
    const box = this.canvas.getBoundingClientRect();
    return this.world([event.clientX - box.left, event.clientY - box.top]);
  }

  zoom(factor, [px, py] = [this.canvas.clientWidth / 2, this.canvas.clientHeight / 2]) {
    const before = this.world([px, py]);
    const {x, y, scale} = this.view();
    const wanted = Math.min(200, Math.max(0.01, scale * factor));
    this.userView = {x, y, scale: wanted};
    const after = this.world([px, py]);
    this.userView = {x: x + before[0] - after[0], y: y + before[1] - after[1], scale: wanted};
    this.draw();
  }

  pan(dx, dy) {
    const {x, y, scale} = this.view();
    this.userView = {x: x - dx / scale, y: y + dy / scale, scale};
    this.draw();
  }

  fit() {
    this.userView = null;
    this.draw();
  }

  /* --- what is shown --- */

  /* Where hands have left everything; null: nothing is moved. */
  hold(places, marks) {
    this.held = places;
    this.redrawn = marks && {live: marks.live, marks: marks.marks, numbers: this.picture.floats(marks.poses)};
  }

  show(film, scene, glimpse) {
    const [a, , , d, e, f] = film.toImage;
    const rect = [-e / a, (film.height - f) / d, (film.width - e) / a, -f / d];
    const empty = film.marks.length === 0 && !scene.sized;
    if (!glimpse || !this.picture || scene.sized) this.rect = empty ? BLANK : rect;
    const before = this.picture;
    this.scene = scene;
    this.glimpse = glimpse;
    this.held = null;
    const picture = new Picture(film, this);
    picture.load();
    this.picture = picture;
    if (before && film.images.length) { // a picture that is known needs not be waited for
      const known = new Map(before.film.images.map((source, k) => [source, before.images[k]]));
      picture.images = picture.images.map((image, k) => known.get(film.images[k]) || image);
    }
    picture.frame = this.pictureFrame();
    this.draw();
  }

  /* A blank sheet. */
  clear() {
    this.picture = this.scene = this.held = null;
    this.free = {motions: [], things: []};
    this.lit = new Set();
    this.rect = BLANK;
    this.draw();
  }

  pictureFrame() {
    return this.glimpse ? 0 : Math.min(this.frame, this.picture.film.frames - 1);
  }

  seek(frame) {
    if (frame !== this.frame) { this.held = null; this.free = {motions: [], things: []}; }
    this.frame = frame;
    this.draw();
  }

  draw() {
    const context = this.canvas.getContext("2d");
    if (!this.picture) {
      context.setTransform(1, 0, 0, 1, 0, 0);
      context.clearRect(0, 0, this.canvas.width, this.canvas.height);
      const [left, bottom, right, top] = this.rect;
      this.transform(context);
      context.fillStyle = "#fff";
      context.fillRect(left, bottom, right - left, top - bottom);
      this.drawOver(context);
      return;
    }
    this.picture.frame = this.pictureFrame();
    this.picture.draw();
  }

  /* Every anchor: [{thing, name, anchor, at}] */
  anchors() {
    if (!this.picture || !this.scene) return [];
    const found = [];
    this.scene.things.forEach((thing, number) => {
      for (const [anchor, local] of Object.entries(thing.anchors)) {
        const at = this.picture.place(number, local, this.picture.frame);
        if (at) found.push({thing: number, anchor, name: `${thing.name}.${anchor}`, at});
      }
    });
    return found;
  }

  drawOver(context) {
    const {scale} = this.view();
    const px = 1 / scale;
    this.transform(context);
    context.globalAlpha = 1;
    context.setLineDash([]);
    context.lineCap = context.lineJoin = "round";
    const anchors = this.anchors();
    for (const paint of this.under) paint(context, px);
    for (const [number, color] of this.colored()) this.outline(context, number, color, 8 * px, anchors);
    for (const number of this.lit) this.outline(context, number, "rgba(255, 170, 0, 0.55)", 7 * px, anchors);
    if (this.hovered !== null && this.hovered.thing !== null) {
      this.outline(context, this.hovered.thing, "rgba(0, 114, 178, 0.35)", 5 * px, anchors);
    }
    if (this.points) for (const {at} of anchors) this.dot(context, at, 3 * px, "#0072b2");
    if (this.hovered && this.hovered.at) this.dot(context, this.hovered.at, 5 * px, "#d55e00");
    if (this.arrows && !this.held) this.drawArrows(context, px);
    this.drawWishes(context, px);
    this.drawPins(context, px);
    if (this.band) {
      context.strokeStyle = "#0072b2";
      context.lineWidth = 2 * px;
      context.setLineDash([6 * px, 5 * px]);
      context.beginPath();
      context.moveTo(...this.band[0]);
      context.lineTo(...this.band[1]);
      context.stroke();
      context.setLineDash([]);
    }
    if (this.names) this.drawNames(context, anchors);
  }

  dot(context, at, radius, color) {
    context.beginPath();
    context.arc(at[0], at[1], radius, 0, 2 * Math.PI);
    context.fillStyle = color;
    context.fill();
  }

  outline(context, number, color, width, anchors) {
    const points = anchors.filter((item) => item.thing === number).map((item) => item.at);
    const thing = this.scene && this.scene.things[number];
    if (!thing) return;
    for (const [other, k] of thing.through) {
      const name = Object.keys(this.scene.things[other].anchors)[k];
      const found = anchors.find((item) => item.thing === other && item.anchor === name);
      if (found) points.push(found.at);
    }
    if (!points.length) return;
    context.strokeStyle = color;
    context.lineWidth = width + (thing.width || 4);
    context.beginPath();
    if (points.length === 1) context.arc(...points[0], (thing.radius || 4) + width / 2, 0, 2 * Math.PI);
    else points.forEach((point, k) => (k ? context.lineTo(...point) : context.moveTo(...point)));
    context.stroke();
  }

  drawArrows(context, px) {
    const box = this.rect;
    const length = Math.max(30 * px, 0.08 * Math.min(box[2] - box[0], box[3] - box[1]));
    this.free.motions.forEach((motion, k) => {
      context.strokeStyle = context.fillStyle = HUES[k % HUES.length];
      context.globalAlpha = motion.wished ? 0.45 : 0.95;
      context.lineWidth = 2.5 * px;
      for (const [, x, y, vx, vy] of motion.arrows) {
        const size = Math.hypot(vx, vy);
        if (size < 1e-3) continue;
        const tip = [x + vx * length, y + vy * length];
        const [ux, uy] = [vx / size, vy / size], head = 8 * px;
        context.beginPath();
        context.moveTo(x, y);
        context.lineTo(...tip);
        context.stroke();
        context.beginPath();
        context.moveTo(tip[0] + ux * head, tip[1] + uy * head);
        context.lineTo(tip[0] - uy * head / 2, tip[1] + ux * head / 2);
        context.lineTo(tip[0] + uy * head / 2, tip[1] - ux * head / 2);
        context.closePath();
        context.fill();
      }
    });
    context.globalAlpha = 1;
  }

  drawWishes(context, px) {
    if (!this.scene) return;
    context.strokeStyle = "#cc79a7";
    context.lineWidth = 1.5 * px;
    for (const {wish} of this.scene.statements) {
      if (!wish) continue;
      const [, , x, y] = wish, r = 6 * px;
      context.beginPath();
      context.arc(x, y, r, 0, 2 * Math.PI);
      context.moveTo(x - 1.6 * r, y);
      context.lineTo(x + 1.6 * r, y);
      context.moveTo(x, y - 1.6 * r);
      context.lineTo(x, y + 1.6 * r);
      context.stroke();
    }
  }

  /* Points that are fixed; rods show that by themselves. */
  drawPins(context, px) {
    if (!this.scene) return;
    context.strokeStyle = "#0072b2";
    context.lineWidth = 1.5 * px;
    for (const {pin} of this.scene.statements) {
      if (!pin || this.scene.things[pin[0]].shape !== "disc") continue;
      const [thing, , x, y] = pin, low = y - (this.scene.things[thing].radius || 4) - 9 * px;
      context.beginPath();
      context.moveTo(x, y);
      context.lineTo(x - 7 * px, low);
      context.lineTo(x + 7 * px, low);
      context.closePath();
      context.moveTo(x - 11 * px, low);
      context.lineTo(x + 11 * px, low);
      context.stroke();
    }
  }

  drawNames(context, anchors) {
    const fine = this.canvas.width / Math.max(1, this.canvas.clientWidth);
    context.setTransform(fine, 0, 0, fine, 0, 0);
    context.font = "12px system-ui, sans-serif";
    context.textBaseline = "bottom";
    context.lineWidth = 3;
    const taken = new Map();
    for (const {name, at} of anchors) {
      const [x, y] = this.local(at);
      const key = `${Math.round(x / 4)} ${Math.round(y / 4)}`;
      const row = taken.get(key) || 0;
      taken.set(key, row + 1);
      context.strokeStyle = "rgba(255, 255, 255, 0.85)";
      context.fillStyle = "#333";
      context.strokeText(name, x + 6, y - 4 - 13 * row);
      context.fillText(name, x + 6, y - 4 - 13 * row);
    }
  }

  /* --- what is under a point --- */

  /* {thing, anchor, name, at}: an anchor where one is near, else a part (anchor and at are null); or null. */
  hit(point, {anchorsOnly = false, partsOnly = false} = {}) {
    if (!this.picture || !this.scene) return null;
    const reach = NEAR / this.view().scale;
    if (!partsOnly) {
      let best = null, least = reach;
      for (const item of this.anchors()) {
        const thing = this.scene.things[item.thing];
        if (thing.hidden) continue;
        const away = Math.hypot(item.at[0] - point[0], item.at[1] - point[1]) - (thing.shape === "disc" ? 1e-3 : 0);
        if (away < least) { least = away; best = item; }
      }
      if (best || anchorsOnly) return best;
    }
    const thing = this.part(point, partsOnly ? new Set(["disc"]) : new Set());
    return thing === null ? null : {thing, anchor: null, name: this.scene.things[thing].name, at: null};
  }

  part(point, left = new Set()) {
    const film = this.picture.film, frame = this.picture.frame;
    for (let k = film.marks.length - 1; k >= 0; k -= 1) {
      const mark = film.marks[k];
      if (this.picture.value(mark.opacity, frame) <= 0) continue;
      const thing = this.covers(mark, point, frame);
      if (thing !== null && !left.has(this.scene.things[thing].shape)) return thing;
    }
    return null;
  }

  covers(mark, point, frame) {
    const picture = this.picture, reach = 4 / this.view().scale;
    if (mark.kind === "link" || mark.kind === "symbol") {
      const rings = mark.kind === "link"
        ? [{ring: mark.through.map(([body, x, y]) => picture.world(body, x, y, frame)), width: mark.width}]
        : mark.parts.map((part) => ({ring: pairs(part.moving.map((n) => picture.value(n, frame))), width: part.width}));
      for (const {ring, width} of rings) {
        if (alongLine(ring, point) <= width / 2 + reach) return this.follower(mark, ring);
      }
      return null;
    }
    const [x, y, degrees] = picture.pose(mark.body, frame);
    const turn = degrees * Math.PI / 180, c = Math.cos(turn), s = Math.sin(turn);
    const [dx, dy] = [point[0] - x, point[1] - y];
    const at = [c * dx + s * dy, c * dy - s * dx];
    const number = this.picture.film.numbers[mark.body];
    if (mark.kind === "line") return alongLine(mark.points, at) <= mark.width / 2 + reach ? number : null;
    if (mark.kind === "disc") {
      return Math.hypot(at[0] - mark.centre[0], at[1] - mark.centre[1]) <= mark.radius + reach ? number : null;
    }
    if (mark.kind === "image") {
      const image = picture.images[mark.image];
      const [a, b, cc, d, e, f] = mark.matrix, det = a * d - b * cc;
      const [ux, uy] = [at[0] - e, at[1] - f];
      const [ix, iy] = [(d * ux - cc * uy) / det, (a * uy - b * ux) / det];
      return ix >= 0 && iy >= 0 && ix <= image.naturalWidth && iy <= image.naturalHeight ? number : null;
    }
    if (mark.kind === "figure") {
      for (const part of mark.parts) {
        const ring = part.rings[0];
        if (part.form === "dot" && Math.hypot(at[0] - ring[0][0], at[1] - ring[0][1]) <= part.width + reach) return number;
        if (part.form === "stroke" && alongLine(part.closed ? [...ring, ring[0]] : ring, at) <= part.width / 2 + reach) return number;
        if (part.form !== "stroke" && part.form !== "dot" && within(ring, at)) return number;
      }
    }
    return null;
  }

  /* The thing that a link or a symbol is the picture of: what is drawn through these anchors. */
  follower(mark, ring) {
    const found = this.scene.things.findIndex((thing) => {
      if (!thing.through.length) return false;
      return thing.through.every(([other, k]) => {
        const local = Object.values(this.scene.things[other].anchors)[k];
        const at = this.picture.place(other, local, this.picture.frame);
        return at && alongLine(ring, at) < 12;
      });
    });
    return found < 0 ? null : found;
  }

  /* Whether a thing (its point `local`, if one is given) is elsewhere at another time of the film. */
  moves(number, local = null) {
    const {picture} = this;
    if (!picture || this.glimpse) return false;
    const key = local ? `${number} ${local.join()}` : number;
    if (!picture.known.has(key)) {
      const size = Math.max(this.rect[2] - this.rect[0], this.rect[3] - this.rect[1]);
      const away = (points) => points[0] && points.some((at) => at && Math.hypot(at[0] - points[0][0], at[1] - points[0][1]) > 1e-4 * size);
      const watched = local ? [local] : [[0, 0], [size, 0], [0, size]];
      picture.known.set(key, watched.some((point) => away(this.path(number, point))));
    }
    return picture.known.get(key);
  }

  /* The path of a thing's local point over the whole film. */
  path(number, local) {
    const film = this.picture.film, held = this.held;
    this.held = null;
    const found = Array.from({length: film.frames}, (_, k) => this.picture.place(number, local, k));
    this.held = held;
    return found;
  }

  /* The local point of a thing at a world point. */
  localPoint(number, point) {
    const o = this.picture.place(number, [0, 0], this.picture.frame);
    const u = this.picture.place(number, [1, 0], this.picture.frame);
    const c = u[0] - o[0], s = u[1] - o[1];
    const [dx, dy] = [point[0] - o[0], point[1] - o[1]];
    return [c * dx + s * dy, c * dy - s * dx];
  }
}

function pairs(numbers) {
  const found = [];
  for (let k = 0; k + 1 < numbers.length; k += 2) found.push([numbers[k], numbers[k + 1]]);
  return found;
}

function alongLine(points, [x, y]) {
  let least = points.length === 1 ? Math.hypot(points[0][0] - x, points[0][1] - y) : Infinity;
  for (let k = 1; k < points.length; k += 1) {
    const [ax, ay] = points[k - 1], [bx, by] = points[k];
    const [ux, uy] = [bx - ax, by - ay];
    const square = ux * ux + uy * uy;
    const t = square === 0 ? 0 : Math.min(1, Math.max(0, ((x - ax) * ux + (y - ay) * uy) / square));
    least = Math.min(least, Math.hypot(ax + t * ux - x, ay + t * uy - y));
  }
  return least;
}

function within(ring, [x, y]) {
  let inside = false;
  for (let k = 0, j = ring.length - 1; k < ring.length; j = k, k += 1) {
    const [ax, ay] = ring[k], [bx, by] = ring[j];
    if ((ay > y) !== (by > y) && x < (bx - ax) * (y - ay) / (by - ay) + ax) inside = !inside;
  }
  return inside;
}
