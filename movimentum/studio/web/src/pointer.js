/* The pointer on the stage: what each tool does with what is under it goes to the server. */
import {Snap} from "./snap.js";
import {Measure} from "./measure.js";

const THRESHOLD = 3; // pixels of the page before a click is a drag
const PATIENCE = 550; // ms that a finger rests before it asks for a menu

const WORDS = {
  select: "", anchor: "Click to make a point; on a part, one more point of it.", rod: "Drag from point to point. Digits set the length, Tab the angle.",
  plate: "Click the corners, and the first one again.", curve: "Click the points; the first one again closes it, Enter leaves it open.",
  gear: "Drag from the middle of the gear to its pitch circle.", spring: "Drag from point to point.", dimension: "Drag from point to point.",
  ground: "Click a point that the ground holds, or a place.", trace: "Click the point whose path is drawn.", label: "Click a point or a place for a text.",
  graph: "Click where the graph is to be.", gap: "Click two parts that touch.",
  angle: "Click two rods to fix their angle.", fix: "Click a point to fix it; click it again to free it.",
  attract: "Drag from a point to where it should go.", turn: "Click a rod to make it turn.", delete: "Click what to delete.",
  shape: "Drag a point of a part to change its shape.",
};
const TO_ANCHORS = ["fix", "attract", "shape", "trace"], TO_PARTS = ["angle", "turn"];
const LINES = ["rod", "spring", "dimension", "gear"], CORNERED = ["plate", "curve"];
const SNAPPING = ["anchor", "shape", "label", "ground", "graph", ...LINES, ...CORNERED];

export class Pointer {
  constructor(app) {
    this.app = app;
    this.tool = "select";
    this.active = null;
    this.first = null; // of two clicks
    this.corners = [];
    this.fingers = new Map();
    this.snap = new Snap(app.stage);
    this.measure = new Measure(app);
    const {canvas} = app.stage;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", (event) => { this.fingers.delete(event.pointerId); this.cancel(); });
    canvas.addEventListener("pointerleave", () => { if (!this.active) this.hover(null); });
    canvas.addEventListener("dblclick", () => { if (CORNERED.includes(this.tool)) this.finish(); });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const box = canvas.getBoundingClientRect();
      app.stage.zoom(Math.exp(-event.deltaY / 400), [event.clientX - box.left, event.clientY - box.top]);
    }, {passive: false});
    canvas.addEventListener("contextmenu", (event) => { event.preventDefault(); if (!this.active) this.askMenu(event); });
  }

  choose(tool) {
    this.tool = tool;
    this.cancel();
    this.app.hint(WORDS[tool]);
    this.app.stage.canvas.dataset.tool = tool;
    this.app.stage.canvas.style.cursor = tool === "select" ? "default" : "crosshair";
  }

  cancel() {
    if (this.active && this.active.grip) this.app.hand.give(this.active.grip);
    clearTimeout(this.resting);
    this.active = null;
    this.first = null;
    this.corners = [];
    this.measure.clear();
    this.clean();
  }

  /* What is laid over the picture while something is drawn goes. */
  clean() {
    const {stage} = this.app;
    stage.band = stage.box = null;
    stage.guides = [];
    stage.pencil = [];
    stage.draw();
  }

  hover(found) {
    const {stage} = this.app;
    const before = stage.hovered;
    if ((found && found.name) === (before && before.name)) return;
    stage.hovered = found;
    stage.draw();
    let cursor = this.tool === "select" ? "default" : "crosshair";
    if (this.tool === "select" && found) cursor = stage.free.things.includes(found.thing) ? "grab" : this.driven(found) ? "ew-resize" : "pointer";
    stage.canvas.style.cursor = cursor;
    stage.canvas.title = found ? this.title(found) : "";
  }

  title(found) {
    const {stage} = this.app;
    const {velocities} = this.app, fast = velocities.on && velocities.of(found.name);
    const speed = fast ? ` (${Number(Math.hypot(...fast.velocity).toPrecision(4))} px per time unit)` : "";
    if (this.tool !== "select" || speed) return `${found.name}${speed}`;
    if (stage.free.things.includes(found.thing)) return `${found.name}: free, drag it`;
    return this.driven(found) ? `${found.name}: driven, drag it along its path` : found.name;
  }

  /* Whether the film moves it: a part, its anchor, or the point of it that was taken hold of. */
  driven(found, local = null) {
    const {stage} = this.app;
    if (!stage.picture || !stage.scene) return false;
    return stage.moves(found.thing, found.anchor === null ? local : stage.scene.things[found.thing].anchors[found.anchor]);
  }

  screen(event) {
    return [event.clientX, event.clientY];
  }

  /* What a tool is about, at a place. */
  under(at) {
    return this.app.stage.hit(at, {anchorsOnly: TO_ANCHORS.includes(this.tool), partsOnly: TO_PARTS.includes(this.tool)});
  }

  askMenu(event) {
    const at = this.app.stage.fromEvent(event);
    this.app.context.open(this.app.stage.hit(at), at, this.screen(event));
  }

  /* --- down, move, up --- */

  down(event) {
    const {app} = this, {stage} = app;
    this.fingers.set(event.pointerId, this.screen(event));
    app.context.shut();
    if (this.fingers.size === 2) { this.pinch(); return; }
    if (this.fingers.size > 2) return;
    stage.canvas.setPointerCapture(event.pointerId);
    if (event.button === 1) {
      this.active = {pan: this.screen(event)};
      event.preventDefault();
      return;
    }
    if (event.button !== 0) return;
    stage.canvas.focus({preventScroll: true});
    const at = stage.fromEvent(event), hit = this.under(at);
    this.active = {tool: this.tool, from: this.screen(event), at, hit, dragged: false, more: event.shiftKey};
    if (event.pointerType === "touch") this.resting = setTimeout(() => { if (this.active && !this.active.dragged) { this.cancel(); this.askMenu(event); } }, PATIENCE);
    if (this.tool === "select" && event.shiftKey) return;
    if (this.tool === "select" && hit) {
      app.clock.pause();
      this.active.grip = app.hand.grab(hit, at);
    } else if (this.tool === "select") {
      this.active.pan = this.screen(event);
    } else if (this.tool === "attract" && hit) {
      app.clock.pause();
      this.active.grip = app.hand.grab(hit, at);
    }
  }

  /* Two fingers: the picture follows both. */
  pinch() {
    this.cancel();
    const [a, b] = [...this.fingers.values()];
    this.active = {pinch: {apart: Math.hypot(a[0] - b[0], a[1] - b[1]), middle: [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2]}};
  }

  pinched() {
    if (this.fingers.size < 2) return;
    const {stage} = this.app, {pinch} = this.active, [a, b] = [...this.fingers.values()];
    const apart = Math.hypot(a[0] - b[0], a[1] - b[1]), middle = [(a[0] + b[0]) / 2, (a[1] + b[1]) / 2];
    const box = stage.canvas.getBoundingClientRect();
    stage.pan(middle[0] - pinch.middle[0], middle[1] - pinch.middle[1]);
    if (pinch.apart > 0) stage.zoom(apart / pinch.apart, [middle[0] - box.left, middle[1] - box.top]);
    this.active.pinch = {apart, middle};
  }

  moved(event) {
    const {app, active} = this, {stage} = app;
    if (this.fingers.has(event.pointerId)) this.fingers.set(event.pointerId, this.screen(event));
    if (active && active.pinch) { this.pinched(); return; }
    const at = stage.fromEvent(event);
    this.last = {at, free: event.altKey};
    if (!active) {
      this.hover(stage.hit(at, {anchorsOnly: [...TO_ANCHORS, "anchor", "rod"].includes(this.tool), partsOnly: TO_PARTS.includes(this.tool)}));
      if (SNAPPING.includes(this.tool)) this.draw(at, event.altKey);
      return;
    }
    const [x, y] = this.screen(event);
    if (active.from && Math.hypot(x - active.from[0], y - active.from[1]) > THRESHOLD) { active.dragged = true; clearTimeout(this.resting); }
    if (active.pan) {
      if (active.from && !active.dragged) return;
      stage.pan(x - active.pan[0], y - active.pan[1]);
      active.pan = [x, y];
      return;
    }
    if (!active.dragged) return;
    if (active.tool === "select" && active.more) { stage.box = [active.at, at]; stage.draw(); return; }
    if (active.grip) {
      stage.hovered = null;
      app.hand.move(active.grip, at);
    }
    if (LINES.includes(active.tool) || (["attract", "shape"].includes(active.tool) && active.hit)) {
      stage.hovered = active.tool === "gear" ? null : stage.hit(at, {anchorsOnly: true});
      this.draw(at, event.altKey);
    }
  }

  up(event) {
    const {app, active} = this, {stage} = app;
    this.fingers.delete(event.pointerId);
    clearTimeout(this.resting);
    if (active && active.pinch) { if (!this.fingers.size) this.active = null; return; }
    if (!active || (active.pan && (!active.from || active.dragged))) { this.active = null; stage.draw(); return; }
    const at = stage.fromEvent(event), box = stage.box;
    this.last = {at, free: event.altKey};
    if (active.grip) app.hand.drop(active.grip, at, active.dragged);
    const end = this.end(at, event.altKey);
    this.active = null;
    if (box && active.tool === "select") app.selectBox(box);
    else this[active.tool](active, end.at, end);
    if (!this.first && !this.corners.length) this.measure.clear();
    this.clean();
  }

  /* --- the pencil --- */

  /* Where the line that is being drawn begins; null: none is. */
  get origin() {
    const {active, first, corners} = this;
    if (corners.length) return corners[corners.length - 1].at;
    if (first && first.at && LINES.includes(this.tool)) return first.at;
    if (!active || !active.dragged || !active.at) return null;
    if (active.hit && active.hit.at) return active.hit.at;
    return LINES.includes(active.tool) ? active.start || (active.start = this.snap.place(active.at).at) : null;
  }

  /* Where the pencil is meant to be: {at, guides, words, hit}. */
  end(at, free = false) {
    const {stage} = this.app, {origin, measure} = this;
    if (!SNAPPING.includes(this.tool)) return {at, guides: [], words: [], hit: null};
    if (origin && measure.fixed) return {at: measure.place(origin, at), guides: [], words: [], hit: null};
    const own = this.tool === "shape" && this.active && this.active.hit ? [this.active.hit.name.split(".")[0]] : [];
    const hit = ["gear", "shape", "graph"].includes(this.tool) && origin ? null : stage.hit(at, {anchorsOnly: true});
    if (hit && !own.length) return {at: hit.at, guides: [], words: [], hit};
    if (free) return {at: at.map((value) => Math.round(value)), guides: [], words: [], hit: null};
    return {...this.snap.place(at, origin, own), hit: null};
  }

  draw(at, free = false) {
    const {stage} = this.app, {origin} = this, end = this.end(at, free);
    stage.guides = end.guides;
    if (origin) this.measure.show(origin, end.at, end.words);
    stage.round = this.tool === "gear";
    if (CORNERED.includes(this.tool)) stage.pencil = this.corners.length ? [...this.corners.map((each) => each.at), end.at] : [];
    else if (this.tool === "gear") stage.pencil = origin ? [origin, end.at] : [];
    else stage.band = origin ? [origin, end.at] : null;
    stage.draw();
  }

  /* What is typed changes it. */
  again() {
    if (this.last) this.draw(this.last.at, this.last.free);
  }

  /* Enter: the line or the shape is as it is now. */
  finish() {
    const {app} = this;
    if (CORNERED.includes(this.tool)) {
      if (this.measure.fixed && this.last) this.corner(this.end(this.last.at));
      else if (this.corners.length >= 3) this.cornered(this.corners);
      else app.hint("Three points or more.");
      this.measure.clear();
      this.clean();
      return;
    }
    if (!this.origin || !this.last) return;
    const end = this.end(this.last.at), active = this.active || {hit: null, at: this.last.at, dragged: false};
    if (active.grip) { app.hand.move(active.grip, end.at); app.hand.give(active.grip); }
    this.active = null;
    this[this.tool](active, end.at, end);
    this.measure.clear();
    this.clean();
  }

  /* --- the tools, when the button is let go --- */

  select({hit, dragged, grip, more}) {
    if (!dragged) this.app.selectThing(hit, more);
    if (grip && !dragged) grip.done = true;
  }

  anchor({hit}, at, end) {
    if (hit && hit.anchor !== null) { this.app.hint(`${hit.name} is there already.`); return; }
    this.app.useTool("anchor", [hit ? hit.name : ""], [end ? end.at : at]);
  }

  /* Two ends, dragged from one to the other or clicked one after the other. */
  ends(tool, {hit, at: from, dragged, start}, end) {
    const here = hit && hit.anchor !== null ? hit : null;
    if (!dragged && !this.first) {
      this.first = {name: here ? here.name : "", at: here ? here.at : end.at};
      this.app.hint("Click the other end. Digits set the length, Tab the angle.");
      return;
    }
    const begun = dragged ? {name: here ? here.name : "", at: here ? here.at : start || from} : this.first;
    this.first = null;
    const name = end.hit ? end.hit.name : "";
    if (begun.name && begun.name === name) return;
    this.app.useTool(tool, [begun.name, name], [begun.at, end.at]);
  }

  rod(active, at, end) { this.ends("rod", active, end || {at, hit: active.hit && active.hit.at ? active.hit : null}); }

  spring(active, at, end) { this.ends("spring", active, end || {at, hit: active.hit}); }

  dimension(active, at, end) { this.ends("dimension", active, end || {at, hit: active.hit}); }

  gear(active, at, end) { this.ends("gear", active, end || {at, hit: null}); }

  plate(_active, at, end) { this.corner(end || {at, hit: _active.hit}); }

  curve(_active, at, end) { this.corner(end || {at, hit: _active.hit}); }

  corner(end) {
    const {corners} = this, first = corners[0];
    const again = first && Math.hypot(end.at[0] - first.at[0], end.at[1] - first.at[1]) < 9 / this.app.stage.view().scale;
    if (again && corners.length >= 3) { this.cornered(this.tool === "curve" ? [...corners, first] : corners); return; }
    if (corners.some(({at}) => Math.hypot(end.at[0] - at[0], end.at[1] - at[1]) < 1e-6)) return;
    corners.push({name: end.hit ? end.hit.name : "", at: end.at});
    this.measure.clear();
  }

  cornered(corners) {
    this.corners = [];
    this.app.useTool(this.tool, corners.map(({name}) => name), corners.map(({at}) => at));
  }

  /* Two parts, clicked one after the other. */
  pair({hit}, words, act) {
    const {app} = this;
    if (!hit) { app.hint(words); return; }
    const {name} = app.stage.scene.things[hit.thing];
    if (!this.first) {
      this.first = name;
      app.stage.lit = new Set([hit.thing]);
      app.hint(`${name}: click the other one.`);
      return;
    }
    const {first} = this;
    this.first = null;
    app.stage.lit = new Set();
    if (first !== name) act(first, name);
  }

  angle(active) { this.pair(active, "Click a rod.", (first, name) => this.app.useTool("angle", [first, name], [])); }

  gap(active) { this.pair(active, "Click a part.", (first, name) => this.app.useTool("gap", [first, name], [])); }

  fix({hit}) {
    if (!hit) { this.app.hint("Click a point."); return; }
    this.app.useTool("fix", [hit.name], [hit.at]);
  }

  ground({hit}, at) { this.app.useTool("ground", [hit && hit.anchor !== null ? hit.name : ""], [at]); }

  trace({hit}) {
    if (hit) this.app.useTool("trace", [hit.name], []);
    else this.app.hint("Click a point.");
  }

  label({hit}, at) {
    const name = hit && hit.anchor !== null ? hit.name : "";
    this.app.forms.ask("Text", [["text", "Text", name ? name.split(".").at(-1) : ""]], ({text}) => { if (text) this.app.useTool("label", [name, text], [at]); });
  }

  graph(_active, at) {
    const {selection, stage} = this.app, chosen = selection[0];
    const offer = chosen ? chosen.anchor ? `${chosen.name}.y` : `${chosen.name}.angle` : stage.scene && stage.scene.things.some(({body}) => body) ? `${stage.scene.things.find(({body}) => body).name}.angle` : "";
    this.app.forms.ask("Graph over time", [["text", "Expression", offer]], ({text}) => { if (text) this.app.useTool("graph", [text], [at]); });
  }

  attract({hit, dragged, grip}, at) {
    if (grip) grip.done = true;
    if (hit && (dragged || !this.first)) {
      this.first = dragged ? null : hit.name;
      if (!dragged) this.app.hint(`${hit.name}: click where it should go.`);
      this.app.useTool("attract", [hit.name], [dragged ? at : hit.at]);
      return;
    }
    if (this.first) {
      this.app.useTool("attract", [this.first], [at]);
      this.first = null;
    } else this.app.hint("Start at a point.");
  }

  turn({hit}) {
    if (!hit) { this.app.hint("Click a rod."); return; }
    this.app.playNext = true;
    this.app.useTool("turn", [this.app.stage.scene.things[hit.thing].name], []);
  }

  delete({hit}) {
    if (hit) this.app.useTool("delete", [this.app.stage.scene.things[hit.thing].name], []);
  }

  shape({hit, dragged}, at) {
    if (hit && dragged) this.app.useTool("shape", [hit.name], [at]);
  }
}
