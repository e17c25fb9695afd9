/* Plays a film on a canvas, which `painter.js` draws. No library, no request.
 *
 *   const player = new MovimentumPlayer(element, film);   // film: what `movimentum.vector.page` writes as JSON
 *   new MovimentumPlayer(element, film, element);         // hears only the keys that are pressed inside the element
 *   player.seek(12); player.play(); player.pause();
 *   player.state();            // {time, frame, frames, playing, anchors: {"Rod.B": [x, y]}}, world coordinates, y up
 *   player.toScreen([x, y]);   // page pixels
 */
"use strict";

class MovimentumPlayer extends MovimentumPainter {
  constructor(element, film, keys = document) {
    super(film, document.createElement("canvas"));
    this.keys = keys;
    this.playing = this.ticking = false;
    this.seen = true;
    this.speed = 1;
    this.loop = film.loop === 0;
    this.rounds = film.loop;
    this.build(element);
    this.load();
    this.resize();
    new ResizeObserver(() => this.resize()).observe(this.canvas);
    new IntersectionObserver((entries) => this.see(entries.at(-1).isIntersecting)).observe(this.canvas);
    const calm = window.matchMedia("(prefers-reduced-motion: reduce)").matches;
    if (film.frames > 1 && !calm) this.play();
  }

  /* --- the page --- */

  build(element) {
    const make = (tag, attributes, parent) => {
      const made = document.createElement(tag);
      for (const [name, value] of Object.entries(attributes)) {
        if (name === "text") made.textContent = value; else made.setAttribute(name, value);
      }
      if (parent) parent.append(made);
      return made;
    };
    const film = this.film;
    element.classList.add("movimentum");
    const label = `${film.title}: ${film.frames} frame${film.frames === 1 ? "" : "s"}`;
    for (const [name, value] of [["data-testid", "stage"], ["role", "img"], ["aria-label", label]]) {
      this.canvas.setAttribute(name, value);
    }
    element.append(this.canvas);
    this.canvas.style.width = `${film.width}px`;
    this.canvas.style.aspectRatio = `${film.width} / ${film.height}`;
    const bar = make("div", {class: "controls", role: "group", "aria-label": "Player"}, element);
    if (film.frames < 2) bar.hidden = true;
    const button = (name, text, title, act) => {
      const made = make("button", {type: "button", "data-testid": name, text, title, "aria-label": title}, bar);
      made.addEventListener("click", (event) => {
        act();
        if (event.detail > 0) this.rest(made);
      });
      return made;
    };
    this.playButton = button("play", "", "", () => this.toggle());
    button("back", "\u2039", "One frame back (left arrow)", () => this.step(-1));
    button("forward", "\u203a", "One frame on (right arrow)", () => this.step(1));
    const range = {type: "range", min: 0, max: film.frames - 1, step: 1, value: 0};
    this.scrubber = make("input", {...range, "data-testid": "scrubber", "aria-label": "Frame"}, bar);
    this.scrubber.addEventListener("input", () => { this.pause(); this.seek(Number(this.scrubber.value)); });
    this.clock = make("output", {"data-testid": "time"}, bar);
    this.speedChoice = make("select", {"data-testid": "speed", "aria-label": "Speed", title: "Speed"}, bar);
    for (const [speed, text] of [[1, "1\u00d7"], [0.5, "\u00bd\u00d7"], [0.25, "\u00bc\u00d7"]]) {
      make("option", {value: speed, text}, this.speedChoice);
    }
    this.speedChoice.addEventListener("change", () => this.setSpeed(Number(this.speedChoice.value)));
    this.loopButton = button("loop", "Loop", "Play again and again", () => this.setLoop(!this.loop));
    this.traceButton = button("traces", "Traces", "Show the paths of anchors", () => this.setTracing(!this.tracing));
    this.setLoop(this.loop);
    this.setTracing(this.tracing);
    this.showPlaying();
    if (film.frames < 2) return;
    this.keys.addEventListener("keydown", (event) => this.key(event));
    if (this.keys !== document) this.canvas.tabIndex = 0;
  }

  rest(button) {  // after the mouse, the space bar plays
    if (this.keys === document) button.blur(); else this.canvas.focus();
  }

  key(event) {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const name = event.target.tagName;
    if (name === "SELECT" || name === "TEXTAREA" || (name === "INPUT" && event.target !== this.scrubber)) return;
    const last = this.film.frames - 1;
    if (event.key === " ") {
      if (name === "BUTTON") return;  // it presses the button
      this.toggle();
    } else if (event.key === "ArrowLeft") this.step(-1);
    else if (event.key === "ArrowRight") this.step(1);
    else if (event.key === "Home") { this.pause(); this.seek(0); }
    else if (event.key === "End") { this.pause(); this.seek(last); }
    else return;
    event.preventDefault();
    if (this.keys !== document) event.stopPropagation();
  }

  resize() {
    const fine = window.devicePixelRatio || 1;
    const width = Math.max(1, Math.round((this.canvas.clientWidth || this.film.width) * fine));
    const height = Math.max(1, Math.round(width * this.film.height / this.film.width));
    if (this.canvas.width !== width || this.canvas.height !== height) {
      this.canvas.width = width;
      this.canvas.height = height;
    }
    this.draw();
  }

  /* --- playing --- */

  play() {
    if (this.playing || this.film.frames < 2) return;
    if (this.frame === this.film.frames - 1) this.frame = 0;
    this.playing = true;
    this.began(this.frame);
    this.showPlaying();
    if (!this.ticking) this.tick();
  }

  see(seen) {  // nothing is drawn that is scrolled away or taken off the page
    this.seen = seen;
    if (seen && this.playing && !this.ticking) this.tick();
  }

  tick() {
    this.ticking = true;
    const tick = (now) => {
      this.ticking = this.playing && this.seen;
      if (!this.ticking) return;
      const passed = Math.floor((now - this.since) / 1000 * this.film.fps * this.speed + 1e-6);
      let frame = this.from + Math.max(0, passed);
      if (frame >= this.film.frames) {
        this.rounds -= 1;
        if (!this.loop && this.rounds < 1) {
          this.seek(this.film.frames - 1);
          this.pause();
          this.rounds = this.film.loop;
          return;
        }
        frame %= this.film.frames;
        this.began(frame);
      }
      if (frame !== this.frame) this.seek(frame, true);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  began(frame) {
    this.from = frame;
    this.since = performance.now();
  }

  pause() {
    this.playing = false;
    this.showPlaying();
  }

  toggle() {
    if (this.playing) this.pause(); else this.play();
  }

  step(frames) {
    this.pause();
    const count = this.film.frames;
    this.seek((this.frame + frames + count) % count);
  }

  seek(frame, playing = false) {
    this.frame = Math.min(Math.max(0, Math.round(frame)), this.film.frames - 1);
    if (this.playing && !playing) this.began(this.frame);
    this.draw();
  }

  setSpeed(speed) {
    this.speed = speed;
    this.speedChoice.value = String(speed);
    this.began(this.frame);
  }

  setLoop(loop) {
    this.loop = loop;
    this.loopButton.setAttribute("aria-pressed", String(loop));
  }

  setTracing(tracing) {
    this.tracing = tracing;
    this.traceButton.setAttribute("aria-pressed", String(tracing));
    if (this.images) this.draw();
  }

  showPlaying() {
    this.playButton.textContent = this.playing ? "\u275a\u275a" : "\u25b6";
    const title = this.playing ? "Pause (space)" : "Play (space)";
    this.playButton.title = title;
    this.playButton.setAttribute("aria-label", title);
    this.playButton.setAttribute("aria-pressed", String(this.playing));
  }

  state() {
    const anchors = {};
    this.film.bodies.forEach((body, index) => {
      for (const [name, [x, y]] of Object.entries(body.anchors)) {
        anchors[`${body.name}.${name}`] = this.world(index, x, y, this.frame);
      }
    });
    const {frame, playing, speed, film} = this;
    return {time: this.time(frame), frame, frames: film.frames, playing, speed, anchors};
  }

  draw() {
    if (!this.images) return;
    super.draw();
    this.scrubber.value = String(this.frame);
    const time = `${this.time(this.frame).toFixed(2)}`;
    this.clock.textContent = `${time} \u00b7 ${this.frame + 1}/${this.film.frames}`;
    this.scrubber.setAttribute("aria-valuetext", `frame ${this.frame + 1} of ${this.film.frames}, time ${time}`);
  }

}
