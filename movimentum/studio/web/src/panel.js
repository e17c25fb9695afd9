/* What is selected, what can be asked about it, and what was answered. It stands off what it is about, and can be moved. */
/* global MovimentumPainter */
import {button, byId, make, onPaper} from "./dom.js";

const ARRANGING = [
  ["level", "level", "Put them on one level"], ["upright", "upright", "Put them one above the other"],
  ["copy", "copy", "Copy them"], ["mirror", "mirror", "Mirror them in an upright line"],
];

export class Panel {
  constructor(app) {
    this.app = app;
    this.info = false;
    this.motions = null;
    this.asked = null; // {question, name}: an answer to another question is not shown
    this.place = null; // where a hand has put it
    this.about = [];
    this.box = byId("panel");
    new ResizeObserver(() => { if (!this.box.hidden) this.stand(); }).observe(byId("room"));
  }

  /* Another selection, or another text: what was asked is about something else. */
  select(hits) {
    this.about = hits;
    this.asked = null;
    this.answered = null;
    this.show();
  }

  freedom(motions) {
    this.motions = motions;
    if (this.info) this.show();
  }

  ask(question, name) {
    this.asked = {question, name};
    this.answered = null;
    this.show();
    this.app.send({kind: "ask", rev: this.app.shownRev, question, name, time: this.app.clock.time});
  }

  answer(message) {
    const {asked} = this;
    if (!asked || asked.question !== message.question || asked.name !== message.name) return;
    this.answered = message;
    this.show();
  }

  get heading() {
    const {about, asked} = this;
    if (about.length > 1) return `${about.length} selected`;
    if (about.length) return about[0].name;
    if (asked) return asked.name || {solutions: "Solutions"}[asked.question] || asked.question;
    return this.info ? "This script" : "";
  }

  close() {
    this.asked = this.answered = null;
    if (this.info) this.app.controls.views.i.click();
    this.app.selectThing(null);
    this.show();
  }

  show() {
    const {box, heading} = this;
    box.hidden = !heading;
    if (box.hidden) return;
    const head = make("header", {}, make("b", {text: heading}));
    button(head, "panel-close", "", "Close", () => this.close(), {icon: "close"});
    head.addEventListener("pointerdown", (event) => this.drag(event));
    const body = make("div", {id: "answer", "data-testid": "answer"}, ...this.rows());
    const bar = this.bar();
    box.replaceChildren(head, ...(bar ? [bar] : []), body);
    this.stand();
  }

  bar() {
    const {app, about} = this;
    if (!about.length) return null;
    const bar = make("div", {class: "bar"});
    if (about.length > 1) {
      for (const [tool, icon, title] of ARRANGING) button(bar, `arrange-${tool}`, "", title, () => this.arrange(tool), {icon});
      button(bar, "arrange-delete", "", "Delete them", () => app.deleteSelection(), {icon: "delete"});
      return bar;
    }
    const [hit] = about, part = app.stage.scene.things[hit.thing];
    for (const question of ["why", "formula"]) button(bar, `ask-${question}`, question, `${question} of ${hit.name}`, () => this.ask(question, hit.name));
    button(bar, "ask-solutions", "solutions", "All poses at this time", () => this.ask("solutions", ""));
    button(bar, "ask-plot", "plot", "Its values over time", () => app.plots.add(hit.anchor ? hit.name : `${hit.name}.angle`));
    if (hit.anchor) bar.append(app.traces.chooser(hit.name));
    if (part.body && !hit.anchor) for (const [tool, icon, title] of ARRANGING.slice(2)) button(bar, `arrange-${tool}`, "", title.replace("them", "it"), () => this.arrange(tool), {icon});
    return bar;
  }

  arrange(tool) {
    const {app} = this, names = [...new Set(this.about.map(({thing}) => app.stage.scene.things[thing].name))];
    const points = app.stage.anchors().filter(({thing}) => this.about.some((hit) => hit.thing === thing)).map(({at}) => at);
    const right = Math.max(...points.map(([x]) => x)), low = Math.min(...points.map(([, y]) => y));
    if (tool === "level" || tool === "upright") app.useTool("align", names, [tool === "level" ? [1, 0] : [0, 1], [0, 0]]);
    else if (tool === "copy") app.useTool("copy", names, [[0, 0], [20, -20]]);
    else app.useTool("mirror", names, [[Math.round(right + 20), Math.round(low)], [0, 0]]);
  }

  rows() {
    const {app, about, answered, asked} = this, rows = [];
    if (about.length > 1) rows.push(make("p", {text: about.map(({name}) => name).join(", ")}));
    if (this.info) {
      const {stage} = app, count = stage.scene ? stage.scene.things.length : 0;
      rows.push(make("p", {text: `${count} things, ${app.clock.frames} frames`}));
      (this.motions || []).forEach((motion, k) => rows.push(make("p", {}, ...inline(`free ${k + 1}: ${motion.words}`))));
      if (this.motions && !this.motions.length) rows.push(make("p", {text: "Nothing is free at this time."}));
    }
    if (asked && !answered) rows.push(make("p", {class: "calm", text: "…"}));
    if (!answered) return rows;
    const {question, name, words, choices, film} = answered;
    if (about.length && name && name !== about[0].name) rows.push(make("b", {text: name}));
    rows.push(make("pre", {"data-question": question}, ...inline(words)));
    const use = ({statement}) => { if (statement) app.useTool("state", [statement], []); };
    const made = choices.map((choice, k) => {
      const title = choice.statement || choice.words;
      const row = make("button", {type: "button", class: "fix", title, "data-testid": `choose-${k}`, onclick: () => use(choice)});
      if (film && choice.frame !== null) row.append(thumbnail(film, choice.frame, choice.current));
      row.append(make("span", {text: title}));
      return row;
    });
    if (made.length) rows.push(make("div", {class: film ? "cards" : ""}, ...made));
    return rows;
  }

  /* In the corner that is farthest from what it is about, unless a hand has put it somewhere. */
  stand() {
    const {box, app, about} = this, room = byId("room"), {stage} = app;
    if (this.place) { this.put(...this.place); return; }
    const points = about.length ? stage.anchors().filter(({thing}) => about.some((hit) => hit.thing === thing)).map(({at}) => stage.local(at)) : [];
    const wide = box.offsetWidth, high = box.offsetHeight, right = room.clientWidth - wide - 8, low = room.clientHeight - high - 8;
    let best = [right, 8], most = -1;
    for (const [x, y] of [[right, 8], [right, Math.max(8, low)], [8, 8], [8, Math.max(8, low)]]) {
      const away = points.reduce((least, [u, v]) => Math.min(least, Math.hypot(Math.max(x - u, 0, u - x - wide), Math.max(y - v, 0, v - y - high))), Infinity);
      if (away > most + 1) { most = away; best = [x, y]; }
      if (!points.length) break;
    }
    this.put(...best);
  }

  put(x, y) {
    const {box} = this, room = byId("room");
    box.style.right = "auto";
    box.style.left = `${Math.max(0, Math.min(x, room.clientWidth - box.offsetWidth))}px`;
    box.style.top = `${Math.max(0, Math.min(y, room.clientHeight - box.offsetHeight - 8))}px`;
  }

  drag(event) {
    if (event.button !== 0 || event.target.closest("button") || getComputedStyle(this.box).position === "fixed") return;
    const {left, top} = this.box.getBoundingClientRect(), room = byId("room").getBoundingClientRect();
    const [dx, dy] = [event.clientX - left + room.left, event.clientY - top + room.top];
    const move = (each) => { this.place = [each.clientX - dx, each.clientY - dy]; this.put(...this.place); };
    const end = () => { window.removeEventListener("pointermove", move); window.removeEventListener("pointerup", end); };
    window.addEventListener("pointermove", move);
    window.addEventListener("pointerup", end);
    event.preventDefault();
  }

  state() {
    return this.box.hidden ? null : {heading: this.heading, text: (byId("answer") || {innerText: ""}).innerText};
  }
}

/* Words with `code`, on their lines. */
export function inline(words) {
  return words.split(/(`[^`]+`)/).filter(Boolean).map((piece) => (piece.startsWith("`") && piece.length > 2 ? make("code", {text: piece.slice(1, -1)}) : piece));
}

/* A small picture of one frame of a film. */
function thumbnail(film, frame, current) {
  const canvas = make("canvas", {class: current ? "thumbnail current" : "thumbnail", role: "img", "aria-label": current ? "the pose on show" : "another pose"});
  canvas.classList.toggle("paper", onPaper(film));
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

