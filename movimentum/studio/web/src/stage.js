/* The picture: the film's painter with a view of its own, what is laid over it, and what is under the pointer. */
/* global MovimentumPainter */
import {onPaper} from "./dom.js";

const HUES = ["#d55e00", "#0072b2", "#009e73", "#cc79a7", "#e69f00", "#56b4e9"];
const BLANK = [0, 0, 640, 480];
const NEAR = 9; // pixels
const GHOSTS = 8;

class Picture extends MovimentumPainter {
  constructor(film, stage) {
    super(film, stage.canvas);
    this.stage = stage;
    this.tracing = true;
    this.unwanted = new Set();
    this.known = new Map();
    this.extents = new Map();
    this.boxes = []; // of texts, in the canvas's pixels
    this.exact = film.exact ? new Float64Array(Uint8Array.from(atob(film.exact), (c) => c.charCodeAt(0)).buffer) : null;
  }

  pose(index, frame) {
    const [dx, dy] = this.stage.shiftOf(this.film.numbers[index]);
    if (dx || dy) {
      const [x, y, degrees] = this.still(index, frame);
      return [x + dx, y + dy, degrees];
    }
    return this.still(index, frame);
  }

  still(index, frame) {
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
      const [dx, dy] = this.stage.shiftOf(number);
      return [ox + c * x - s * y + dx, oy + s * x + c * y + dy];
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
    this.moved(mark, (there) => super.words(there));
  }

  /* Where texts are: names keep off them. */
  text(mark) {
    if (!this.extents.has(mark)) this.extents.set(mark, extent(mark.path));
    const [left, low, right, high] = this.extents.get(mark);
    const there = this.context.getTransform().multiply(new DOMMatrix(mark.matrix));
    const corners = [[left, low], [right, low], [right, high], [left, high]].map(([x, y]) => there.transformPoint({x, y}));
    const [xs, ys] = [corners.map(({x}) => x), corners.map(({y}) => y)];
    this.boxes.push([Math.min(...xs), Math.min(...ys), Math.max(...xs), Math.max(...ys)]);
    super.text(mark);
  }

  moved(mark, paint) {
    const other = this.stage.held && this.stage.redrawn;
    if (!other || !this.film.marks.includes(mark)) { paint(mark); return; }
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
    this.stage.drawGhosts(context);
  }

  draw() {
    if (!this.images || this.stage.picture !== this) return;
    this.boxes = [];
    super.draw();
    this.stage.drawOver(this.context);
    this.stage.shown();
  }

  /* The parts alone as they are in some frames, each paler than the picture: on a sheet of its own. */
  ghostsOf(frames) {
    const {context, frame, stage} = this, {held, redrawn} = stage;
    const sheet = document.createElement("canvas");
    sheet.width = this.canvas.width;
    sheet.height = this.canvas.height;
    stage.held = stage.redrawn = null;
    this.context = sheet.getContext("2d");
    this.context.lineCap = this.context.lineJoin = "round";
    stage.transform(this.context);
    for (const each of frames) {
      this.frame = Math.min(each, this.film.frames - 1);
      this.drawMarks(this.film.marks, this.film.camera);
    }
    Object.assign(stage, {held, redrawn});
    Object.assign(this, {context, frame});
    return sheet;
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
    this.overlapping = () => [];
    this.shown = () => {};
    this.hovered = null;
    this.band = null;
    this.guides = []; // lines that something snaps to
    this.pencil = []; // what is being drawn: corners, or the middle and a point of a circle
    this.round = false;
    this.box = null; // of a selection that is being drawn
    this.ghosts = "off"; // poses beside the one on show: "off", "here" (at `ghost`), "many"
    this.ghost = 0;
    this.grid = false;
    this.shift = null; // {things, by}: what a hand moves that no statement holds
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

  /* The same through the film's camera. */
  seen() {
    const {x, y, scale} = this.view();
    const [zoom, right, up] = this.camera();
    return {x: (x - right) / zoom, y: (y - up) / zoom, scale: scale * zoom};
  }

  /* What the film's camera makes of a world point: as much larger, and moved. */
  camera() {
    const film = this.picture && this.picture.film;
    return film && film.camera ? film.camera.map((number) => this.picture.value(number, this.picture.frame)) : [1, 0, 0];
  }

  transform(context, {x, y, scale} = this.view()) {
    const fine = this.canvas.width / Math.max(1, this.canvas.clientWidth);
    const k = fine * scale;
    context.setTransform(k, 0, 0, -k, this.canvas.width / 2 - k * x, this.canvas.height / 2 + k * y);
  }

  /* From the world to the canvas in the page's pixels, and back. */
  local([wx, wy]) {
    const {x, y, scale} = this.seen();
    return [this.canvas.clientWidth / 2 + scale * (wx - x), this.canvas.clientHeight / 2 - scale * (wy - y)];
  }

  world([px, py], {x, y, scale} = this.seen()) {
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
    const before = this.world([px, py], this.view());
    const {x, y, scale} = this.view();
    const wanted = Math.min(200, Math.max(0.01, scale * factor));
    this.userView = {x, y, scale: wanted};
    const after = this.world([px, py], this.view());
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

  /* How far a hand has moved a thing that no statement holds. */
  shiftOf(number) {
    return this.shift && this.shift.things.has(number) ? this.shift.by : [0, 0];
  }

  show(film, scene, glimpse) {
    const [a, , , d, e, f] = film.toImage;
    const rect = [-e / a, (film.height - f) / d, (film.width - e) / a, -f / d];
    const empty = film.marks.length === 0 && !scene.sized;
    if (!glimpse || !this.picture || scene.sized) this.rect = empty ? BLANK : rect;
    const before = this.picture;
    this.scene = scene;
    this.glimpse = glimpse;
    this.held = this.shift = null;
    const picture = new Picture(film, this);
    picture.load();
    this.picture = picture;
    this.canvas.classList.toggle("paper", onPaper(film));
    if (before && film.images.length) { // a picture that is known needs not be waited for
      const known = new Map(before.film.images.map((source, k) => [source, before.images[k]]));
      picture.images = picture.images.map((image, k) => known.get(film.images[k]) || image);
    }
    picture.frame = this.pictureFrame();
    this.draw();
  }

  /* A blank sheet. */
  clear() {
    this.picture = this.scene = this.held = this.shift = null;
    this.canvas.classList.add("paper");
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
      if (this.grid) this.drawGrid(context, 1 / this.view().scale);
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
    const {scale} = this.seen();
    const px = 1 / scale;
    this.transform(context, this.seen());
    context.globalAlpha = 1;
    context.setLineDash([]);
    context.lineCap = context.lineJoin = "round";
    const anchors = this.anchors();
    for (const paint of this.under) paint(context, px);
    for (const number of this.overlapping()) this.outline(context, number, "rgba(208, 20, 44, 0.6)", 6 * px, anchors);
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
    this.drawPencil(context, px);
    if (this.names) this.drawNames(context, anchors);
  }

  /* What is being drawn, and what it snaps to. */
  drawPencil(context, px) {
    const dashed = (points, color, width, dash, closed = false) => {
      context.strokeStyle = color;
      context.lineWidth = width * px;
      context.setLineDash(dash.map((each) => each * px));
      context.beginPath();
      points.forEach((point, k) => (k ? context.lineTo(...point) : context.moveTo(...point)));
      if (closed) context.closePath();
      context.stroke();
      context.setLineDash([]);
    };
    for (const guide of this.guides) dashed(guide, "#cc2f8f", 1, [4, 4]);
    if (this.band) dashed(this.band, "#0072b2", 2, [6, 5]);
    if (this.pencil.length > 1 && this.round) {
      const [[x, y], [u, v]] = this.pencil;
      context.strokeStyle = "#0072b2";
      context.lineWidth = 2 * px;
      context.beginPath();
      context.arc(x, y, Math.hypot(u - x, v - y), 0, 2 * Math.PI);
      context.stroke();
    } else if (this.pencil.length > 1) dashed(this.pencil, "#0072b2", 2, [6, 5]);
    for (const at of this.pencil) this.dot(context, at, 3.5 * px, "#0072b2");
    if (this.box) {
      const [[x, y], [u, v]] = this.box;
      context.fillStyle = "rgba(0, 114, 178, 0.1)";
      context.fillRect(Math.min(x, u), Math.min(y, v), Math.abs(u - x), Math.abs(v - y));
      dashed([[x, y], [u, y], [u, v], [x, v]], "#0072b2", 1, [], true);
    }
  }

  drawGrid(context, px) {
    const [left, bottom, right, top] = this.rect, step = this.gridStep();
    context.lineWidth = px;
    for (let x = Math.ceil(left / step) * step; x <= right; x += step) this.gridLine(context, [x, bottom], [x, top], Math.round(x / step) % 5 === 0);
    for (let y = Math.ceil(bottom / step) * step; y <= top; y += step) this.gridLine(context, [left, y], [right, y], Math.round(y / step) % 5 === 0);
  }

  gridLine(context, from, to, strong) {
    context.strokeStyle = strong ? "rgba(90, 110, 140, 0.28)" : "rgba(90, 110, 140, 0.13)";
    context.beginPath();
    context.moveTo(...from);
    context.lineTo(...to);
    context.stroke();
  }

  /* Of a grid whose squares can be seen. */
  gridStep() {
    let step = 10;
    while (step * this.view().scale < 7) step *= 5;
    return step;
  }

  /* Other poses: under the parts. Their sheet is kept while nothing about it changes. */
  drawGhosts(context) {
    const {picture} = this;
    if (this.grid) {
      this.transform(context);
      context.globalAlpha = 1;
      this.drawGrid(context, 1 / this.view().scale);
    }
    const frames = this.ghostFrames();
    if (!frames.length) return;
    const {x, y, scale} = this.view();
    const key = [frames, x, y, scale, this.canvas.width, this.canvas.height, picture.images.every((image) => image.complete)].join();
    if (picture.ghostKey !== key) {
      picture.ghostKey = key;
      picture.ghostSheet = picture.ghostsOf(frames);
    }
    context.save();
    context.setTransform(1, 0, 0, 1, 0, 0);
    context.globalAlpha = 0.22;
    context.drawImage(picture.ghostSheet, 0, 0);
    context.restore();
  }

  /* The poses that are shown as ghosts. What a hand has moved leaves one behind. */
  ghostFrames() {
    if (!this.picture || this.glimpse) return [];
    const last = this.picture.film.frames - 1;
    if (this.ghosts === "many" && last > 0) return Array.from({length: GHOSTS}, (_, k) => Math.round(k * last / (GHOSTS - 1)));
    const found = this.ghosts === "here" ? [Math.min(this.ghost, last)] : [];
    if (this.held) found.push(this.pictureFrame());
    return found;
  }

  dot(context, at, radius, color) {
    context.beginPath();
    context.arc(at[0], at[1], radius, 0, 2 * Math.PI);
    context.fillStyle = color;
    context.fill();
  }

  /* A line around a thing as it is drawn, `width` broader than its own; through its anchors where nothing is drawn. */
  outline(context, number, color, width, anchors) {
    const {picture} = this, thing = this.scene && this.scene.things[number];
    if (!thing || !picture) return;
    context.save();
    context.strokeStyle = context.fillStyle = color;
    let drawn = false;
    for (const mark of picture.film.marks) {
      if (picture.film.numbers[mark.body] !== number || picture.value(mark.opacity, picture.frame) <= 0) continue;
      drawn = this.around(context, mark, width) || drawn;
    }
    if (!drawn) this.through(context, number, thing, width, anchors);
    context.restore();
  }

  around(context, mark, width) {
    const {picture} = this, [x, y, degrees] = picture.pose(mark.body, picture.frame);
    const path = (rings, closed) => {
      context.beginPath();
      for (const ring of rings) {
        ring.forEach((point, k) => (k ? context.lineTo(...point) : context.moveTo(...point)));
        if (closed) context.closePath();
      }
      context.stroke();
    };
    context.save();
    context.translate(x, y);
    context.rotate(degrees * Math.PI / 180);
    context.lineWidth = width;
    const act = {
      line: () => { context.lineWidth = width + mark.width; path([mark.points]); },
      disc: () => { context.beginPath(); context.arc(...mark.centre, mark.radius + width / 4, 0, 2 * Math.PI); context.stroke(); },
      image: () => {
        const image = picture.images[mark.image];
        context.transform(...mark.matrix);
        context.lineWidth = width / Math.hypot(mark.matrix[0], mark.matrix[1]);
        context.strokeRect(0, 0, image.naturalWidth, image.naturalHeight);
      },
      figure: () => {
        const outer = mark.parts.reduce((best, part) => (part.rings[0].length > 2 && size(part.rings[0]) > size(best) ? part.rings[0] : best), []);
        const fullest = outer.length ? mark.parts.filter((part) => part.rings[0] === outer) : mark.parts;
        for (const part of fullest) {
          if (part.form === "dot" || part.form === "ring") {
            context.beginPath();
            context.arc(...part.rings[0][0], part.form === "dot" ? part.width : part.radius, 0, 2 * Math.PI);
            context.stroke();
          } else {
            context.lineWidth = width + (part.form === "stroke" ? part.width || 0 : 0);
            path(part.rings, part.closed || part.form === "fill");
          }
        }
      },
    }[mark.kind];
    if (act) act();
    context.restore();
    return Boolean(act);
  }

  through(context, number, thing, width, anchors) {
    const points = anchors.filter((item) => item.thing === number).map((item) => item.at);
    for (const [other, k] of thing.through) {
      const name = Object.keys(this.scene.things[other].anchors)[k];
      const found = anchors.find((item) => item.thing === other && item.anchor === name);
      if (found) points.push(found.at);
    }
    if (!points.length) return;
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

  /* Each name once, beside its point: off texts, off the points and off the other names, as far as there is room. */
  drawNames(context, anchors) {
    const fine = this.canvas.width / Math.max(1, this.canvas.clientWidth);
    context.setTransform(fine, 0, 0, fine, 0, 0);
    context.font = "12px system-ui, sans-serif";
    context.textBaseline = "middle";
    context.lineWidth = 3;
    const shown = anchors.filter(({thing}) => !this.scene.things[thing].hidden).map(({name, at}) => ({name, at: this.local(at)}));
    const taken = [
      ...this.picture.boxes.map((box) => box.map((value) => value / fine)),
      ...shown.map(({at: [x, y]}) => [x - 4, y - 4, x + 4, y + 4]),
    ];
    this.labels = [];
    for (const {name, at: [x, y]} of shown) {
      const wide = context.measureText(name).width + 2, high = 14;
      let best = null, least = Infinity;
      for (const away of [8, 20, 32, 44]) {
        for (const [dx, dy] of [[0.7, -0.7], [0.7, 0.7], [-0.7, -0.7], [-0.7, 0.7], [1, 0], [-1, 0], [0, -1], [0, 1]]) {
          const left = x + away * dx + (dx > 0.1 ? 0 : dx < -0.1 ? -wide : -wide / 2), top = y + away * dy - high / 2;
          const box = [left, top, left + wide, top + high];
          const outside = box[0] < 0 || box[1] < 0 || box[2] > this.canvas.clientWidth || box[3] > this.canvas.clientHeight;
          const cost = away / 40 + (outside ? 3 : 0) + taken.reduce((sum, other) => sum + overlap(box, other), 0);
          if (cost < least) { least = cost; best = box; }
        }
        if (least < 1) break;
      }
      taken.push(best);
      this.labels.push(best);
      context.strokeStyle = "rgba(255, 255, 255, 0.85)";
      context.fillStyle = "#333";
      context.strokeText(name, best[0] + 1, best[1] + high / 2);
      context.fillText(name, best[0] + 1, best[1] + high / 2);
    }
  }

  /* --- what is under a point --- */

  /* {thing, anchor, name, at}: an anchor where one is near, else a part (anchor and at are null); or null. */
  hit(point, {anchorsOnly = false, partsOnly = false} = {}) {
    if (!this.picture || !this.scene) return null;
    const reach = NEAR / this.seen().scale;
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
    const [zoom, right, up] = this.camera();
    const still = [zoom * point[0] + right, zoom * point[1] + up];
    for (let k = film.marks.length - 1; k >= 0; k -= 1) {
      const mark = film.marks[k];
      if (this.picture.value(mark.opacity, frame) <= 0) continue;
      const thing = this.covers(mark, mark.still ? still : point, frame);
      if (thing !== null && !left.has(this.scene.things[thing].shape)) return thing;
    }
    return null;
  }

  covers(mark, point, frame) {
    const picture = this.picture, reach = 4 / this.seen().scale;
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

/* What a path's numbers reach to: [left, low, right, high]. */
function extent(path) {
  const values = (path.match(/-?\d*\.?\d+(?:e-?\d+)?/gi) || ["0", "0"]).map(Number);
  const xs = values.filter((_, k) => k % 2 === 0), ys = values.filter((_, k) => k % 2 === 1);
  const least = (some) => some.reduce((a, b) => Math.min(a, b), Infinity), most = (some) => some.reduce((a, b) => Math.max(a, b), -Infinity);
  return [least(xs), least(ys), most(xs), most(ys)];
}

function overlap(a, b) {
  const wide = Math.min(a[2], b[2]) - Math.max(a[0], b[0]), high = Math.min(a[3], b[3]) - Math.max(a[1], b[1]);
  return wide > 0 && high > 0 ? 1 + wide * high / 50 : 0;
}

/* Of a ring: its box's width and height. */
function size(ring) {
  const xs = ring.map(([x]) => x), ys = ring.map(([, y]) => y);
  return ring.length ? Math.max(...xs) - Math.min(...xs) + Math.max(...ys) - Math.min(...ys) : -1;
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
