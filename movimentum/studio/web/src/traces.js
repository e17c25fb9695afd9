/* The paths of anchors: as the script has them, as tails, whole, or none; one by one if somebody says so. */
import {byId, make} from "./dom.js";

export const MODES = [["script", "Traces"], ["tail", "Traces: tails"], ["whole", "Traces: whole"], ["off", "Traces: none"]];
const MOST_POINTS = 4000; // of a path that is drawn

export class Traces {
  constructor(app) {
    this.app = app;
    this.mode = "script";
    this.own = new Map(); // of an anchor's name
    this.paths = new Map();
  }

  /* Another film. */
  forget() {
    this.paths.clear();
    this.choose(this.mode);
  }

  of(name) {
    return this.own.get(name) || this.mode;
  }

  choose(mode) {
    this.mode = mode;
    byId("traces").value = mode;
    this.apply();
  }

  /* Only this one; null: as all. */
  chooseFor(name, mode) {
    if (mode === null) this.own.delete(name); else this.own.set(name, mode);
    this.apply();
  }

  next() {
    const at = MODES.findIndex(([mode]) => mode === this.mode);
    this.choose(MODES[(at + 1) % MODES.length][0]);
    this.app.hint({script: "Traces: as in the script.", tail: "Traces: tails.", whole: "Traces: whole paths.", off: "No traces."}[this.mode]);
  }

  /* Which of the script's own traces the painter draws. */
  apply() {
    const {stage} = this.app;
    if (stage.picture) {
      const {film} = stage.picture;
      const kept = (trace) => this.of(this.nameOf(trace)) === "script";
      stage.picture.tracing = true;
      stage.picture.traces = film.traces.filter(kept);
      stage.picture.unwanted = new Set(film.paths.filter((path) => !kept(path)));
    }
    stage.draw();
  }

  /* The anchor that a trace of the film is of. */
  nameOf(trace) {
    const body = this.app.stage.picture.film.bodies[trace.body];
    const near = ([, [x, y]]) => Math.hypot(x - trace.point[0], y - trace.point[1]) < 1e-6;
    const found = Object.entries(body.anchors).find(near);
    return found ? `${body.name}.${found[0]}` : body.name;
  }

  /* [{name, thing, local}] of everything that could be traced. */
  candidates() {
    const {stage} = this.app;
    if (!stage.picture || !stage.scene || stage.glimpse) return [];
    return stage.scene.things.flatMap((thing, number) => thing.hidden ? [] :
      Object.entries(thing.anchors).map(([anchor, local]) => ({name: `${thing.name}.${anchor}`, thing: number, local})));
  }

  /* {frames, points} of an anchor over the film; null if it stays where it is. */
  path({name, thing, local}) {
    if (!this.paths.has(name)) {
      const {stage} = this.app, {film} = stage.picture;
      const stride = Math.max(1, Math.ceil(film.frames / MOST_POINTS)), points = [], frames = [];
      const held = stage.held;
      stage.held = null;
      for (let frame = 0; frame < film.frames; frame += stride) {
        const at = stage.picture.place(thing, local, frame);
        if (at) { points.push(at); frames.push(frame); }
      }
      stage.held = held;
      const moves = points.some(([x, y]) => Math.hypot(x - points[0][0], y - points[0][1]) > 1e-6 * (1 + Math.abs(x) + Math.abs(y)));
      this.paths.set(name, moves ? {points, frames} : null);
    }
    return this.paths.get(name);
  }

  color(thing) {
    const {film} = this.app.stage.picture;
    const body = film.bodies[film.numbers.indexOf(thing)];
    return body ? `rgb(${body.color.map(Math.round).join(",")})` : "#0072b2";
  }

  draw(context, px) {
    const {stage, clock} = this.app;
    for (const item of this.candidates()) {
      const mode = this.of(item.name);
      if (mode !== "tail" && mode !== "whole") continue;
      const path = this.path(item);
      if (!path) continue;
      context.strokeStyle = this.color(item.thing);
      context.lineWidth = 2 * px;
      if (mode === "whole") this.line(context, path.points, 0, path.points.length - 1, stage.scene.loops, 0.6);
      else this.tail(context, path, stage.picture.frame, Math.min(clock.frames / 4, clock.fps));
    }
    context.globalAlpha = 1;
  }

  line(context, points, from, to, closed, opacity) {
    context.globalAlpha = opacity;
    context.beginPath();
    for (let k = from; k <= to; k += 1) context.lineTo(...points[k]);
    if (closed) context.lineTo(...points[from]);
    context.stroke();
  }

  /* The last frames, fading. */
  tail(context, {points, frames}, now, length) {
    let last = frames.length - 1;
    while (last > 0 && frames[last] > now) last -= 1;
    let first = last;
    while (first > 0 && frames[first - 1] >= now - length) first -= 1;
    for (let k = first; k < last; k += 1) this.line(context, points, k, k + 1, false, 0.1 + 0.9 * (1 - (now - frames[k + 1]) / length));
  }

  state() {
    return this.candidates().filter(({name}) => ["tail", "whole"].includes(this.of(name))).map(({name}) => ({name, mode: this.of(name)}));
  }

  /* A choice for one anchor. */
  chooser(name) {
    const made = make("select", {"aria-label": `Trace of ${name}`, "data-testid": `trace-${name}`, onchange: () => this.chooseFor(name, made.value || null)},
      ...[["", "trace: as all"], ["tail", "trace: tail"], ["whole", "trace: whole"], ["off", "trace: off"]].map(([value, text]) => make("option", {value, text})));
    made.value = this.own.get(name) || "";
    return made;
  }
}
