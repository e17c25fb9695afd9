/* Buttons, keys, sliders, questions and plots. */
/* global MovimentumPainter */
import {button, byId, make, toggle} from "./dom.js";
import {MODES} from "./traces.js";

const TOOLS = [
  ["select", "Select", "Select and drag (V)", "v"], ["anchor", "Anchor", "Make points (A)", "a"],
  ["rod", "Rod", "Rods from point to point (R)", "r"], ["angle", "Angle", "Fix the angle of two rods (G)", "g"],
  ["fix", "Fix", "Fix a point (F)", "f"], ["attract", "Attract", "Pull a point somewhere (T)", "t"],
  ["turn", "Turn", "Make a rod turn by itself (U)", "u"],
  ["delete", "Delete", "Remove (D)", "d"], ["shape", "Shape", "Edit the shape of a part (E)", "e"],
];

export class Controls {
  constructor(app) {
    this.app = app;
    this.buttons = {};
    this.drawTools();
    this.drawViews();
    this.drawCopies();
    document.addEventListener("keydown", (event) => this.key(event));
  }

  drawTools() {
    const {app} = this, bar = byId("tools");
    for (const [tool, text, title] of TOOLS) {
      this.buttons[tool] = button(bar, `tool-${tool}`, text, title, () => this.choose(tool), {"aria-pressed": String(tool === "select")});
    }
    button(bar, "clear", "Clear", "Empty the script (X; undo restores it)", () => this.clear());
    button(bar, "undo", "↶", "Undo (Ctrl-Z)", () => app.editor.undo());
    button(bar, "redo", "↷", "Redo (Ctrl-Y)", () => app.editor.redo());
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
    button(bar, "view", "View", "Switch the view: plain, names, free motions (Q)", () => this.nextView());
    const shown = (name) => (on) => { stage[name] = on; stage.draw(); };
    this.views = {
      n: toggle(bar, "names", "Names", "Names of points (N)", stage.names, shown("names")),
      p: toggle(bar, "points", "Points", "All points (P)", stage.points, shown("points")),
      m: toggle(bar, "arrows", "Free", "Arrows for free motions (M)", stage.arrows, shown("arrows")),
      s: toggle(bar, "velocity", "Velocity", "Arrows for the velocities of all points (S)", false, (on) => app.velocities.show(on)),
      i: toggle(bar, "info", "Info", "Facts about the scene and the selection (I)", false, (on) => { this.info = on; this.showInfo(); }),
    };
    const traces = make("select", {id: "traces", "data-testid": "traces", "aria-label": "Traces", title: "The paths of points (L)", onchange: () => app.traces.choose(traces.value)},
      ...MODES.map(([value, text]) => make("option", {value, text})));
    bar.append(traces);
    button(bar, "zoom-out", "−", "Zoom out (−)", () => stage.zoom(1 / 1.25));
    button(bar, "fit", "Fit", "The whole picture (0)", () => stage.fit());
    button(bar, "zoom-in", "+", "Zoom in (+)", () => stage.zoom(1.25));
    button(bar, "full", "Full", "Full screen (W)", () => this.fullScreen());
    app.record.button = button(byId("player"), "record", "● Record", "Record what you do as a film (K)", () => app.record.toggle(), {"aria-pressed": "false"});
    const expression = make("input", {type: "text", placeholder: "plot …", title: "Plot an expression over time, such as Rod.B.x or Crank.angle", "aria-label": "Plot an expression", "data-testid": "plot-expression"});
    expression.addEventListener("change", () => this.plot(expression.value.trim()));
    bar.append(expression);
  }

  /* Beside the buttons for files: the picture on show. */
  drawCopies() {
    const {app} = this, bar = byId("file-bar");
    button(bar, "screenshot", "PNG", "Save the picture as PNG (Shift-S)", () => app.copies.screenshot());
    button(bar, "copy-png", "Copy PNG", "Copy the picture as PNG (C)", () => app.copies.copyPng());
    button(bar, "copy-svg", "Copy SVG", "Copy the picture as SVG (Shift-C)", () => app.copies.copySvg());
  }

  choose(tool) {
    for (const [name, made] of Object.entries(this.buttons)) made.setAttribute("aria-pressed", String(name === tool));
    this.app.pointer.choose(tool);
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
    if (this.plain(event, name)) event.preventDefault();
  }

  plain(event, element) {
    const {app} = this, {clock, stage} = app, {key} = event;
    const slider = element === "INPUT" && event.target !== clock.scrubber;
    const tool = TOOLS.find((each) => each[3] === key.toLowerCase());
    const way = {ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1]}[key];
    if (way && event.shiftKey && element !== "INPUT") { app.cross.move(...way); return true; }
    if (key === " ") { if (element === "BUTTON") return false; clock.toggle(); }
    else if (key === "ArrowLeft" && !slider) clock.step(-1);
    else if (key === "ArrowRight" && !slider) clock.step(1);
    else if (key === "Home" && !slider) { clock.pause(); clock.seek(0); }
    else if (key === "End" && !slider) { clock.pause(); clock.seek(clock.frames - 1); }
    else if (key === "Escape") { app.pointer.cancel(); app.cross.leave(); app.hand.leave(); app.selectThing(null); stage.draw(); }
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
    else if (key === "." || key === ",") app.cross.next(key === "." ? 1 : -1);
    else if (key === "Enter" && event.target === stage.canvas) app.cross.use();
    else if (key === "Delete" || key === "Backspace") { if (app.selected) app.useTool("delete", [stage.scene.things[app.selected.thing].name], []); }
    else if (this.views[key.toLowerCase()]) this.views[key.toLowerCase()].click();
    else if (tool) this.choose(tool[0]);
    else return false;
    return true;
  }

  /* --- what is known --- */

  freedom(motions) {
    this.motions = motions;
    this.showInfo();
  }

  selection(hit) {
    this.chosen = hit;
    this.showInfo();
  }

  showInfo() {
    const {app} = this, place = byId("answer"), hit = this.chosen;
    place.hidden = !(this.info || hit);
    if (place.hidden) return;
    const rows = [];
    if (hit) {
      rows.push(make("b", {text: hit.name}), make("span", {class: "bar"},
        ...["why", "formula"].map((question) => make("button", {type: "button", "data-testid": `ask-${question}`, text: question, onclick: () => app.ask(question, hit.name)})),
        make("button", {type: "button", "data-testid": "ask-solutions", text: "solutions", onclick: () => app.ask("solutions", "")}),
        ...(hit.anchor ? [app.traces.chooser(hit.name)] : []),
        make("button", {type: "button", text: "plot", onclick: () => this.plot(hit.anchor ? hit.name : `${hit.name}.angle`)}),
        make("button", {type: "button", text: "×", "aria-label": "Close", onclick: () => app.selectThing(null)})));
    }
    if (this.info) {
      const {stage} = app;
      const count = stage.scene ? stage.scene.things.length : 0;
      rows.push(make("p", {text: `${count} things, ${app.clock.frames} frames`}));
      (this.motions || []).forEach((motion, k) => rows.push(make("p", {text: `free ${k + 1}: ${motion.words}`})));
      if (this.motions && !this.motions.length) rows.push(make("p", {text: "Nothing is free at this time."}));
    }
    this.answerPlace = make("pre", {});
    place.replaceChildren(...rows, this.answerPlace);
  }

  answer(question, name, words, choices, film) {
    const place = byId("answer");
    place.hidden = false;
    if (!this.answerPlace || !place.contains(this.answerPlace)) {
      this.answerPlace = make("pre", {});
      const close = make("button", {type: "button", text: "×", "aria-label": "Close", onclick: () => { place.hidden = true; }});
      place.replaceChildren(make("span", {class: "bar"}, make("b", {text: name || question}), close), this.answerPlace);
    }
    const use = ({statement}) => { if (statement) this.app.useTool("state", [statement], []); };
    const rows = choices.map((choice, k) => {
      const title = choice.statement || choice.words;
      const made = make("button", {type: "button", class: "fix", title, "data-testid": `choose-${k}`, onclick: () => use(choice)});
      if (film && choice.frame !== null) made.append(this.thumbnail(film, choice.frame, choice.current));
      made.append(make("span", {text: title}));
      return made;
    });
    this.answerPlace.replaceChildren(make("span", {text: words}), make("div", {class: film ? "cards" : ""}, ...rows));
  }

  /* A small picture of one frame of a film. */
  thumbnail(film, frame, current) {
    const canvas = make("canvas", {class: current ? "thumbnail current" : "thumbnail", role: "img", "aria-label": current ? "the pose on show" : "another pose"});
    const fine = window.devicePixelRatio || 1, scale = Math.min(150 / film.width, 110 / film.height);
    canvas.width = Math.max(1, film.width * scale * fine);
    canvas.height = Math.max(1, film.height * scale * fine);
    canvas.style.width = `${film.width * scale}px`;
    const painter = new MovimentumPainter({...film, background: film.background || film.paper}, canvas);
    painter.frame = frame;
    painter.tracing = false;
    painter.load();
    painter.draw();
    return canvas;
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

  /* --- plots --- */

  plot(expression) {
    const place = byId("plot");
    this.plotting = expression;
    place.hidden = !expression;
    if (expression) this.app.send({kind: "plot", rev: this.app.shownRev, expression});
  }

  plotted({expression, rows, words}) {
    const place = byId("plot"), {clock} = this.app;
    if (expression !== this.plotting) return;
    const close = make("button", {type: "button", text: "×", "aria-label": "Close the plot", onclick: () => this.plot("")});
    if (words) { place.replaceChildren(make("p", {text: words}), close); return; }
    const canvas = make("canvas", {"data-testid": "plot", role: "img", "aria-label": `${expression} over time`, title: "Click to go to a time"});
    const told = make("output", {"data-testid": "plot-value"});
    place.replaceChildren(told, canvas, close);
    const values = rows.flat().filter((value) => value !== null);
    const low = Math.min(...values), high = Math.max(...values), span = high - low || 1;
    const part = () => clock.frames < 2 ? 0 : clock.frame / (clock.frames - 1);
    canvas.addEventListener("click", (event) => { clock.pause(); clock.seek(event.offsetX / canvas.clientWidth * (clock.frames - 1)); });
    this.repaint = () => {
      const fine = window.devicePixelRatio || 1, width = canvas.clientWidth, height = canvas.clientHeight;
      canvas.width = width * fine;
      canvas.height = height * fine;
      const context = canvas.getContext("2d");
      context.scale(fine, fine);
      const x = (k) => rows.length < 2 ? 0 : k * width / (rows.length - 1);
      (rows[0] || []).forEach((_, column) => {
        context.strokeStyle = ["#0072b2", "#d55e00"][column % 2];
        context.beginPath();
        rows.forEach((row, k) => {
          if (row[column] === null) return;
          const y = 4 + (height - 8) * (high - row[column]) / span;
          if (k && rows[k - 1][column] !== null) context.lineTo(x(k), y); else context.moveTo(x(k), y);
        });
        context.stroke();
      });
      context.fillStyle = "#555";
      context.font = "11px system-ui, sans-serif";
      if (values.length) {
        context.fillText(short(high), 3, 12);
        context.fillText(short(low), 3, height - 4);
      }
      context.strokeStyle = "#888";
      context.beginPath();
      context.moveTo(part() * width, 0);
      context.lineTo(part() * width, height);
      context.stroke();
      const now = rows[Math.round(part() * (rows.length - 1))] || [];
      told.textContent = `${expression} = ${now.map((value) => (value === null ? "–" : short(value))).join(", ")}`;
    };
    this.repaint();
  }

  /* Another time is shown. */
  moved() {
    if (this.repaint && !byId("plot").hidden) this.repaint();
  }
}

const short = (value) => String(Number(value.toPrecision(5)));
