/* The start page: a blank sheet, what was open last, and examples that move. */
/* global MovimentumPainter */
import {byId, make, onPaper} from "./dom.js";

const WIDE = 132, HIGH = 88; // of a thumbnail, in pixels

export class Start {
  constructor(app) {
    this.app = app;
    this.places = new Map();
    this.playing = [];
  }

  /* `back`: there is a script behind it. */
  show(gallery, recent, back = false) {
    const place = byId("start"), {app} = this;
    const close = back ? [make("button", {type: "button", "data-testid": "start-close", text: "Back to the script", onclick: () => { place.hidden = true; }})] : [];
    const blank = make("button", {type: "button", class: "main", "data-testid": "blank", text: "A blank sheet", onclick: () => this.blank()});
    place.replaceChildren(
      make("h2", {text: "Begin"}),
      make("p", {class: "calm", text: "Draw a mechanism on a blank sheet, or change an example."}),
      make("div", {class: "cards"}, blank, make("button", {type: "button", "data-testid": "start-open", text: "Open a file …", onclick: () => app.files.askOpen()}), ...close),
      ...this.list("Open again", "recent", recent), ...this.list("Examples", "gallery", gallery));
    place.hidden = false;
  }

  list(title, source, names) {
    if (!names.length) return [];
    const cards = names.map((name, k) => {
      const picture = make("canvas", {class: "thumbnail", width: WIDE, height: HIGH, "aria-hidden": "true"});
      this.places.set(`${source} ${k}`, picture);
      const short = source === "recent" ? name.split(/[\\/]/).at(-1) : name;
      return make("button", {type: "button", class: "card", "data-testid": `${source}-${k}`, title: name, onclick: () => this.open(source, k)},
        picture, make("span", {text: short}));
    });
    return [make("h3", {text: title}), make("div", {class: "cards pictures"}, ...cards)];
  }

  open(source, number) {
    this.app.playNext = source === "gallery";
    this.app.send({kind: "open", source, number, name: ""});
  }

  blank() {
    if (this.app.editor.text) { this.app.send({kind: "open", source: "blank", number: 0, name: ""}); return; }
    byId("start").hidden = true;
    this.app.guide.begin();
    this.app.controls.choose("anchor");
    this.app.stage.canvas.focus();
  }

  /* A thumbnail is there: it moves from now on, if the user likes things to move. */
  thumbnail({source, number, film, seconds}) {
    const canvas = this.places.get(`${source} ${number}`);
    if (!canvas || byId("start").hidden) return;
    const fine = window.devicePixelRatio || 1, scale = Math.min(WIDE / film.width, HIGH / film.height);
    canvas.width = Math.max(1, film.width * scale * fine);
    canvas.height = Math.max(1, film.height * scale * fine);
    canvas.style.width = `${film.width * scale}px`;
    canvas.style.height = `${film.height * scale}px`;
    canvas.classList.toggle("paper", onPaper(film));
    const painter = new MovimentumPainter({...film, background: film.background || film.paper}, canvas);
    painter.tracing = film.traces.length > 0;
    painter.load();
    painter.ready.then(() => { canvas.dataset.moves = String(film.frames > 1); });
    if (film.frames < 2 || window.matchMedia("(prefers-reduced-motion: reduce)").matches) return;
    this.playing.push({canvas, painter, frames: film.frames, seconds: Math.max(1, seconds), begun: performance.now()});
    if (this.playing.length === 1) requestAnimationFrame((now) => this.move(now));
  }

  move(now) {
    const place = byId("start");
    if (place.hidden) { this.playing = []; this.places.clear(); return; }
    const {top, bottom} = place.getBoundingClientRect();
    for (const {canvas, painter, frames, seconds, begun} of this.playing) {
      const frame = Math.floor(Math.max(0, now - begun) / 1000 / seconds * frames) % frames;
      const box = canvas.getBoundingClientRect();
      if (frame === painter.frame || box.bottom < top || box.top > bottom || box.bottom < 0 || box.top > window.innerHeight) continue;
      painter.frame = frame;
      painter.draw();
      canvas.dataset.frame = String(frame);
    }
    requestAnimationFrame((later) => this.move(later));
  }
}
