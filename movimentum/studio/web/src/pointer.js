/* The pointer on the stage: each tool is an object with `down`, `move`, `up`; what they find out goes to the server. */

const THRESHOLD = 3; // pixels of the page before a click is a drag

export class Pointer {
  constructor(app) {
    this.app = app;
    this.tool = "select";
    this.active = null;
    this.first = null; // of two clicks
    const canvas = app.stage.canvas;
    canvas.addEventListener("pointerdown", (event) => this.down(event));
    canvas.addEventListener("pointermove", (event) => this.moved(event));
    canvas.addEventListener("pointerup", (event) => this.up(event));
    canvas.addEventListener("pointercancel", () => this.cancel());
    canvas.addEventListener("pointerleave", () => { if (!this.active) this.hover(null); });
    canvas.addEventListener("wheel", (event) => {
      event.preventDefault();
      const box = canvas.getBoundingClientRect();
      app.stage.zoom(Math.exp(-event.deltaY / 400), [event.clientX - box.left, event.clientY - box.top]);
    }, {passive: false});
    canvas.addEventListener("contextmenu", (event) => { if (this.active) event.preventDefault(); });
  }

  choose(tool) {
    this.tool = tool;
    this.cancel();
    const words = {
      select: "", anchor: "Click to make a point.", rod: "Drag from point to point.",
      angle: "Click two rods to fix their angle.", fix: "Click a point to fix it; click it again to free it.",
      attract: "Drag from a point to where it should go.", turn: "Click a rod to make it turn.", delete: "Click what to delete.",
      shape: "Drag a point of a part to change its shape.",
    };
    this.app.hint(words[tool]);
    this.app.stage.canvas.dataset.tool = tool;
  }

  cancel() {
    if (this.active && this.active.grip) this.active.grip.done = true;
    this.active = null;
    this.first = null;
    this.app.stage.band = null;
    this.app.stage.draw();
  }

  hover(found) {
    const {stage} = this.app;
    const before = stage.hovered;
    if ((found && found.name) === (before && before.name)) return;
    stage.hovered = found;
    stage.draw();
    let cursor = this.tool === "select" ? "default" : "crosshair";
    if (this.tool === "select" && found) cursor = stage.free.things.includes(found.thing) ? "grab" : this.driven(found) ? "ew-resize" : "not-allowed";
    stage.canvas.style.cursor = cursor;
    stage.canvas.title = found ? this.title(found) : "";
  }

  title(found) {
    const {stage} = this.app;
    const {velocities} = this.app, fast = velocities.on && velocities.of(found.name);
    const speed = fast ? ` (${Number(Math.hypot(...fast.velocity).toPrecision(4))} px per time unit)` : "";
    if (this.tool !== "select" || speed) return `${found.name}${speed}`;
    if (stage.free.things.includes(found.thing)) return `${found.name}: free, drag it`;
    return this.driven(found) ? `${found.name}: driven, drag it along its path` : `${found.name}: fixed`;
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

  down(event) {
    if (event.button === 1 || (event.button === 0 && event.shiftKey && this.tool === "select")) {
      this.active = {pan: this.screen(event)};
      this.app.stage.canvas.setPointerCapture(event.pointerId);
      event.preventDefault();
      return;
    }
    if (event.button !== 0) return;
    const {app} = this, {stage} = app;
    stage.canvas.setPointerCapture(event.pointerId);
    stage.canvas.focus({preventScroll: true});
    const at = stage.fromEvent(event);
    const hit = stage.hit(at, {anchorsOnly: ["fix", "attract", "shape"].includes(this.tool), partsOnly: ["angle", "turn"].includes(this.tool)});
    this.active = {tool: this.tool, from: this.screen(event), at, hit, dragged: false};
    if (this.tool === "select" && hit) {
      app.clock.pause();
      this.active.grip = app.hand.grab(hit, at);
    } else if (this.tool === "select" && !hit) {
      this.active.pan = this.screen(event);
    } else if (this.tool === "attract" && hit) {
      app.clock.pause();
      this.active.grip = app.hand.grab(hit, at);
    }
  }

  moved(event) {
    const {app, active} = this, {stage} = app;
    const at = stage.fromEvent(event);
    if (!active) {
      const anchorsOnly = ["anchor", "rod", "fix", "attract", "shape"].includes(this.tool);
      this.hover(stage.hit(at, {anchorsOnly, partsOnly: this.tool === "angle"}));
      return;
    }
    const [x, y] = this.screen(event);
    if (active.from && Math.hypot(x - active.from[0], y - active.from[1]) > THRESHOLD) active.dragged = true;
    if (active.pan) {
      if (active.from && !active.dragged) return;
      stage.pan(x - active.pan[0], y - active.pan[1]);
      active.pan = [x, y];
      return;
    }
    if (!active.dragged) return;
    if (active.grip) {
      stage.hovered = null;
      app.hand.move(active.grip, at);
    }
    if (active.tool === "rod" || (active.tool === "attract" && active.hit) || (active.tool === "shape" && active.hit)) {
      stage.hovered = stage.hit(at, {anchorsOnly: true});
      stage.band = [active.hit && active.hit.at ? active.hit.at : active.at, at];
      if (active.tool === "attract" && active.hit) stage.band = [active.hit.at, at];
      stage.draw();
    }
  }

  up(event) {
    const {app, active} = this, {stage} = app;
    this.active = null;
    stage.band = null;
    if (!active || (active.pan && (!active.from || active.dragged))) { stage.draw(); return; }
    const at = stage.fromEvent(event);
    if (active.grip) app.hand.drop(active.grip, at, active.dragged);
    this[active.tool](active, at);
    stage.draw();
  }

  /* --- the tools, when the button is let go --- */

  select({hit, dragged, grip}) {
    if (hit && !dragged) this.app.selectThing(hit);
    else if (!hit && !dragged) this.app.selectThing(null);
    if (grip && !dragged) grip.done = true;
  }

  anchor({hit}, at) {
    if (hit && hit.anchor !== null) { this.app.hint(`${hit.name} is there already.`); return; }
    this.app.useTool("anchor", [hit ? hit.name : ""], [at]);
  }

  rod({hit, at: from, dragged}, at) {
    if (!dragged) {
      const here = hit && hit.anchor !== null ? hit : null;
      if (!this.first) {
        this.first = {name: here ? here.name : "", at: here ? here.at : from};
        this.app.hint("Click the other end.");
        return;
      }
      const first = this.first;
      this.first = null;
      if (first.name && here && first.name === here.name) return;
      this.app.useTool("rod", [first.name, here ? here.name : ""], [first.at, here ? here.at : at]);
      return;
    }
    this.first = null;
    const begin = hit && hit.anchor !== null ? hit : null;
    const end = this.app.stage.hit(at, {anchorsOnly: true});
    if (begin && end && begin.name === end.name) return;
    this.app.useTool("rod", [begin ? begin.name : "", end ? end.name : ""], [begin ? begin.at : from, end ? end.at : at]);
  }

  angle({hit}) {
    if (!hit) { this.app.hint("Click a rod."); return; }
    const {name} = this.app.stage.scene.things[hit.thing];
    if (!this.first) {
      this.first = name;
      this.app.stage.lit = new Set([hit.thing]);
      this.app.hint(`${name}: click the other rod.`);
      return;
    }
    const first = this.first;
    this.first = null;
    this.app.stage.lit = new Set();
    if (first !== name) this.app.useTool("angle", [first, name], []);
  }

  fix({hit}) {
    if (!hit) { this.app.hint("Click a point."); return; }
    this.app.useTool("fix", [hit.name], [hit.at]);
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
