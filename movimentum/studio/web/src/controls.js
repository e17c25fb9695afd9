/* Buttons, keys and sliders. */
import {button, byId, make, toggle} from "./dom.js";
import {MODES} from "./traces.js";

/* [name, key, title], group by group; null: a line between. */
const TOOLS = [
  ["select", "v", "Select and drag"], ["shape", "e", "Edit the shape of a part"], null,
  ["anchor", "a", "Points"], ["rod", "r", "Rods from point to point"], ["plate", "b", "A plate with three joints or more"], ["gear", "", "A gear"],
  ["curve", "", "A smooth curve"], ["picture", "", "A picture as a part"], null,
  ["fix", "f", "Fix a point"], ["angle", "g", "Fix the angle of two rods"], ["turn", "u", "Make a rod turn by itself"], ["attract", "t", "Pull a point somewhere"],
  ["gap", "", "Two parts that touch"], ["spring", "", "A spring"], ["ground", "", "The ground under a point"], null,
  ["trace", "", "The path of a point"], ["dimension", "", "A dimension between two points"], ["label", "", "A text"], ["graph", "", "A graph over time"],
  ["claim", "", "A claim that is checked"], ["constant", "", "A constant with a slider"], null, ["delete", "d", "Remove"],
];
const GHOSTS = [["off", "Ghosts"], ["here", "Ghosts: this pose"], ["many", "Ghosts: film"]];

export class Controls {
  constructor(app) {
    this.app = app;
    this.buttons = {};
    this.drawTools();
    this.drawSteps();
    this.drawViews();
    document.addEventListener("keydown", (event) => this.key(event));
  }

  drawTools() {
    const rail = byId("tools");
    for (const tool of TOOLS) {
      if (!tool) { rail.append(make("hr")); continue; }
      const [name, key, words] = tool, title = key ? `${words} (${key.toUpperCase()})` : words;
      this.buttons[name] = button(rail, `tool-${name}`, "", title, () => this.choose(name), {icon: name, "aria-pressed": String(name === "select")});
    }
  }

  drawSteps() {
    const {app} = this, bar = byId("undo-bar");
    button(bar, "undo", "", "Undo (Ctrl-Z)", () => app.editor.undo(), {icon: "undo"});
    button(bar, "redo", "", "Redo (Ctrl-Y)", () => app.editor.redo(), {icon: "redo"});
    button(bar, "history", "", "All steps", () => app.steps.show(), {icon: "history"});
    button(bar, "clear", "", "Empty the script (X; undo restores it)", () => this.clear(), {icon: "clear"});
    button(bar, "help", "", "Keys (?)", () => app.files.showKeys(), {icon: "help"});
  }

  clear() {
    const {app} = this;
    app.editor.apply([{from: 0, to: app.editor.text.length, text: ""}]);
    app.hint("The script is empty; Ctrl-Z restores it.");
  }

  fullScreen() {
    const place = byId("showing"), refused = () => this.app.hint("This browser cannot show the picture on the full screen.");
    if (document.fullscreenElement) document.exitFullscreen();
    else if (place.requestFullscreen) place.requestFullscreen().catch(refused);
    else refused();
  }

  /* Plain, with names, with the free motions: one after the other. */
  nextView() {
    const {stage} = this.app, names = ["plain", "names", "free motions"];
    const now = stage.names ? 1 : stage.arrows ? 2 : 0, next = (now + 1) % 3;
    for (const [key, on] of [["n", next === 1], ["m", next === 2]]) {
      if ((this.views[key].getAttribute("aria-pressed") === "true") !== on) this.views[key].click();
    }
    this.app.hint(`View: ${names[next]}.`);
  }

  drawViews() {
    const {app} = this, {stage} = app, bar = byId("views");
    const shown = (name) => (on) => { stage[name] = on; stage.draw(); };
    const gap = () => bar.append(make("span", {class: "gap"}));
    button(bar, "view", "", "Switch the view: plain, names, free motions (Q)", () => this.nextView(), {icon: "view"});
    this.views = {
      n: toggle(bar, "names", "", "Names of points (N)", stage.names, shown("names"), {icon: "names"}),
      p: toggle(bar, "points", "", "All points (P)", stage.points, shown("points"), {icon: "points"}),
      m: toggle(bar, "arrows", "", "Arrows for free motions (M)", stage.arrows, shown("arrows"), {icon: "free"}),
      s: toggle(bar, "velocity", "", "Arrows for the velocities of all points (S)", false, (on) => app.velocities.show(on), {icon: "velocity"}),
      h: toggle(bar, "grid", "", "Grid: what is drawn snaps to it (H)", false, shown("grid"), {icon: "grid"}),
      j: toggle(bar, "overlaps", "", "Overlaps: a red outline, and a mark on the scrubber (J)", false, (on) => app.overlaps.show(on), {icon: "overlaps"}),
      i: toggle(bar, "info", "", "Facts about the scene and the selection (I)", false, (on) => { app.panel.info = on; app.panel.show(); }, {icon: "info"}),
    };
    gap();
    const chooser = (id, label, title, rows, act) => {
      const made = make("select", {id, "data-testid": id, "aria-label": label, title, onchange: () => act(made.value)}, ...rows.map(([value, text]) => make("option", {value, text})));
      bar.append(made);
      return made;
    };
    chooser("traces", "Traces", "The paths of points (L)", MODES, (value) => app.traces.choose(value));
    this.ghosts = chooser("ghosts", "Ghosts", "Other poses beside this one (O)", GHOSTS, (value) => this.ghost(value));
    gap();
    button(bar, "zoom-out", "", "Zoom out (−)", () => stage.zoom(1 / 1.25), {icon: "out"});
    button(bar, "fit", "", "The whole picture (0)", () => stage.fit(), {icon: "fit"});
    button(bar, "zoom-in", "", "Zoom in (+)", () => stage.zoom(1.25), {icon: "in"});
    button(bar, "full", "", "Full screen (W)", () => this.fullScreen(), {icon: "full"});
    app.record.button = button(byId("player"), "record", "", "Record what you do as a film (K)", () => app.record.toggle(), {icon: "record", "aria-pressed": "false"});
    this.expression = make("input", {type: "text", placeholder: "Plot: Rod.B.x; Crank.angle …", title: "Plot expressions over time, such as Rod.B.x; Crank.angle, or one over another: Rod.B.y over Rod.B.x", "aria-label": "Plot an expression", "data-testid": "plot-expression", spellcheck: "false", autocomplete: "off"});
    this.expression.addEventListener("change", () => app.plots.set(this.expression.value));
    bar.append(this.expression);
  }

  /* Poses beside the one on show; "here": this one stays behind. */
  ghost(mode) {
    const {stage, clock} = this.app;
    stage.ghosts = mode;
    stage.ghost = clock.frame;
    this.ghosts.value = mode;
    stage.draw();
  }

  nextGhost() {
    const at = GHOSTS.findIndex(([mode]) => mode === this.app.stage.ghosts), [mode, words] = GHOSTS[(at + 1) % GHOSTS.length];
    this.ghost(mode);
    this.app.hint(mode === "off" ? "No ghosts." : `${words}.`);
  }

  choose(tool) {
    const {app} = this;
    if (tool === "picture") { app.drop.choose(); return; }
    if (tool === "claim" || tool === "constant") { app.forms[tool](); return; }
    for (const [name, made] of Object.entries(this.buttons)) made.setAttribute("aria-pressed", String(name === tool));
    app.pointer.choose(tool);
    app.faces.show();
  }

  key(event) {
    const {app} = this, control = event.ctrlKey || event.metaKey;
    if (control && event.key.toLowerCase() === "s") { event.preventDefault(); app.files.save(); return; }
    if (control && event.key.toLowerCase() === "o") { event.preventDefault(); app.files.askOpen(); return; }
    if (control && event.key.toLowerCase() === "e") { event.preventDefault(); app.editor.focus(); return; }
    const inEditor = event.target.closest && event.target.closest("#editor");
    if (event.key === "Escape" && inEditor) { if (!event.defaultPrevented) app.stage.canvas.focus(); return; }
    if (inEditor || byId("dialog").open) return;
    if (control && !event.altKey && ["z", "y"].includes(event.key.toLowerCase()) && event.target.tagName !== "INPUT") {
      event.preventDefault();
      if (event.key.toLowerCase() === "y" || event.shiftKey) app.editor.redo(); else app.editor.undo();
      return;
    }
    if (control || event.altKey) return;
    const name = event.target.tagName;
    if (name === "SELECT" || name === "TEXTAREA" || (name === "INPUT" && event.target.type !== "range")) return;
    if (app.pointer.measure.key(event) || this.plain(event, name)) event.preventDefault();
  }

  plain(event, element) {
    const {app} = this, {clock, stage} = app, {key} = event;
    const slider = element === "INPUT" && event.target !== clock.scrubber;
    const tool = TOOLS.find((each) => each && each[1] && each[1] === key.toLowerCase());
    const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[key];
    if (way && event.shiftKey && element !== "INPUT") { app.cross.move(...way); return true; }
    if (key === " ") { if (element === "BUTTON") return false; clock.toggle(); }
    else if (key === "ArrowLeft" && !slider) clock.step(-1);
    else if (key === "ArrowRight" && !slider) clock.step(1);
    else if (key === "Home" && !slider) { clock.pause(); clock.seek(0); }
    else if (key === "End" && !slider) { clock.pause(); clock.seek(clock.frames - 1); }
    else if (key === "Escape") { app.pointer.cancel(); app.cross.leave(); app.hand.leave(); app.panel.asked = null; app.selectThing(null); stage.draw(); }
    else if (key === "+" || key === "=") stage.zoom(1.25);
    else if (key === "-") stage.zoom(1 / 1.25);
    else if (key === "0") stage.fit();
    else if (key === "S") app.copies.screenshot();
    else if (key.toLowerCase() === "q") this.nextView();
    else if (key.toLowerCase() === "w") this.fullScreen();
    else if (key.toLowerCase() === "k") app.record.toggle();
    else if (key.toLowerCase() === "x") this.clear();
    else if (key === "C") app.copies.copySvg();
    else if (key === "c") app.copies.copyPng();
    else if (key.toLowerCase() === "l") app.traces.next();
    else if (key.toLowerCase() === "o") this.nextGhost();
    else if (key.toLowerCase() === "y" && stage.held) app.hand.keep();
    else if (key === "?") app.files.showKeys();
    else if (key === "." || key === ",") app.cross.next(key === "." ? 1 : -1);
    else if (key === "Enter" && event.target === stage.canvas) { if (app.pointer.corners.length) app.pointer.finish(); else app.cross.use(); }
    else if (key === "Delete" || key === "Backspace") app.deleteSelection();
    else if (this.views[key.toLowerCase()]) this.views[key.toLowerCase()].click();
    else if (tool) this.choose(tool[0]);
    else return false;
    return true;
  }

  /* --- constants as sliders --- */

  constants(found) {
    const place = byId("sliders");
    if (found === null) return;
    const same = this.sliders && this.sliders.map((item) => item.name).join() === found.map((item) => item.name).join();
    if (!same) {
      this.sliders = found.map((item) => {
        const input = make("input", {type: "range", min: item.least, max: item.most, step: "any", value: item.value, "aria-label": item.name, "data-testid": `slider-${item.name}`});
        const output = make("output", {});
        const made = {name: item.name, input, output, item};
        input.addEventListener("input", () => this.slid(made));
        input.addEventListener("change", () => { if (this.scrub) this.scrub.live.done(); this.scrub = null; });
        return made;
      });
      place.replaceChildren(...this.sliders.map(({name, input, output}) => make("label", {}, make("span", {text: name}), input, output)));
    }
    found.forEach((item, k) => {
      const made = this.sliders[k];
      made.item = item;
      if (document.activeElement !== made.input) made.input.value = String(item.value);
      made.output.textContent = `${Number(item.value.toPrecision(5))}${item.unit ? ` ${item.unit}` : ""}`;
    });
  }

  /* A slider moves the number in the text; one way of it is one step to undo. */
  slid(made) {
    const {item} = made, {app} = this;
    if (!this.scrub || this.scrub.name !== item.name) {
      if (!item.range || app.spansRev !== app.rev) return;
      this.scrub = {name: item.name, live: app.editor.scrubbed(item.range)};
    }
    const step = (item.most - item.least) / 200;
    const digits = Math.max(0, Math.ceil(-Math.log10(step)));
    this.scrub.live.set(Number(Number(made.input.value).toFixed(digits)).toString());
  }
}
