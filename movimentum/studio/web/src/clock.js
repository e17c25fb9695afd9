/* The time that is shown: playing, scrubbing, stepping. */
import {button, face, make, toggle} from "./dom.js";

export class Clock {
  constructor(bar, {shown, settled}) {
    this.told = {shown, settled};
    this.frame = 0;
    this.frames = 1;
    this.fps = 24;
    this.start = 0;
    this.speed = 1;
    this.loop = true;
    this.playing = false;
    this.settling = 0;
    this.playButton = button(bar, "play", "", "Play (space)", () => this.toggle(), {icon: "play"});
    button(bar, "back", "", "One frame back (left arrow)", () => this.step(-1), {icon: "back"});
    button(bar, "forward", "", "One frame forward (right arrow)", () => this.step(1), {icon: "forward"});
    this.scrubber = make("input", {type: "range", min: 0, max: 0, step: 1, value: 0, "data-testid": "scrubber", "aria-label": "Frame"});
    this.ticks = make("div", {class: "ticks", "aria-hidden": "true"});
    bar.append(make("div", {class: "scrub"}, this.ticks, this.scrubber));
    this.scrubber.addEventListener("input", () => { this.pause(); this.seek(Number(this.scrubber.value)); });
    this.output = make("output", {"data-testid": "time"});
    bar.append(this.output);
    this.speeds = make("select", {"data-testid": "speed", "aria-label": "Speed", title: "Speed"});
    for (const [speed, text] of [[1, "1×"], [0.5, "½×"], [0.25, "¼×"]]) this.speeds.append(make("option", {value: speed, text}));
    this.speeds.addEventListener("change", () => this.setSpeed(Number(this.speeds.value)));
    bar.append(this.speeds);
    toggle(bar, "loop", "", "Repeat", true, (on) => { this.loop = on; }, {icon: "loop"});
  }

  get time() {
    return this.start + this.frame / this.fps;
  }

  /* Another film; the time stays. */
  film({frames, fps, start, steps, contacts = []}) {
    const time = this.time;
    this.frames = frames;
    this.fps = fps;
    this.start = start;
    this.frame = Math.min(frames - 1, Math.max(0, Math.round((time - start) * fps)));
    this.scrubber.max = String(frames - 1);
    this.scrubber.disabled = frames < 2;
    this.failing = this.failing || [];
    this.ticks.replaceChildren(...steps.map((step) => {
      const tick = make("i", {title: `@${step}`});
      tick.style.left = `${frames < 2 ? 0 : 100 * (step - start) * fps / (frames - 1)}%`;
      return tick;
    }));
    for (const {time, event, words} of contacts.slice(0, 400)) {
      const mark = make("s", {
        class: event, "data-testid": "contact", title: `${words}, t = ${Number(time.toFixed(4))}`,
        onclick: () => { this.pause(); this.seek((time - this.start) * this.fps); },
      });
      mark.style.left = `${frames < 2 ? 0 : 100 * (time - start) * fps / (frames - 1)}%`;
      this.ticks.append(mark);
    }
    this.broken(this.failing);
    this.overlapping(this.touching || []);
    if (this.playing) this.began();
    this.tell();
  }

  /* Frames from `first` to `last` in which a claim fails, red on the scrubber. */
  broken(runs) {
    this.failing = runs;
    for (const old of [...this.ticks.querySelectorAll("b")]) old.remove();
    for (const [first, last] of runs.slice(0, 200)) {
      const mark = make("b", {"data-testid": "failing"});
      const part = 100 / Math.max(1, this.frames - 1);
      mark.style.left = `${part * first}%`;
      mark.style.width = `max(3px, ${part * (last - first)}%)`;
      this.ticks.append(mark);
    }
  }

  /* Times from and to which something overlaps: red frames on the scrubber. */
  overlapping(spans) {
    this.touching = spans;
    for (const old of [...this.ticks.querySelectorAll("u")]) old.remove();
    const length = Math.max(1, this.frames - 1) / this.fps;
    for (const [from, to] of spans.slice(0, 200)) {
      const mark = make("u", {"data-testid": "overlapping"});
      mark.style.left = `${100 * (from - this.start) / length}%`;
      mark.style.width = `max(4px, ${100 * (to - from) / length}%)`;
      this.ticks.append(mark);
    }
  }

  tell() {
    this.scrubber.value = String(this.frame);
    const time = this.time.toFixed(2);
    this.output.textContent = `${time} · ${this.frame + 1}/${this.frames}`;
    this.scrubber.setAttribute("aria-valuetext", `frame ${this.frame + 1} of ${this.frames}, time ${time}`);
    clearTimeout(this.settling);
    if (!this.playing) this.settling = setTimeout(() => this.told.settled(), 60);
  }

  seek(frame, playing = false) {
    this.frame = Math.min(Math.max(0, Math.round(frame)), this.frames - 1);
    if (this.playing && !playing) this.began();
    this.told.shown(this.frame);
    this.tell();
  }

  step(frames) {
    this.pause();
    this.seek((this.frame + frames + this.frames) % this.frames);
  }

  setSpeed(speed) {
    this.speed = speed;
    this.speeds.value = String(speed);
    this.began();
  }

  toggle() {
    if (this.playing) this.pause(); else this.play();
  }

  pause() {
    if (!this.playing) return;
    this.playing = false;
    this.showPlaying();
    this.tell();
  }

  play() {
    if (this.playing || this.frames < 2) return;
    if (this.frame === this.frames - 1) this.frame = 0;
    this.playing = true;
    this.began();
    this.showPlaying();
    const tick = (now) => {
      if (!this.playing) return;
      let frame = this.from + Math.max(0, Math.floor((now - this.since) / 1000 * this.fps * this.speed + 1e-6));
      if (frame >= this.frames) {
        if (!this.loop) { this.seek(this.frames - 1, true); this.pause(); return; }
        frame %= this.frames;
        this.from = frame;
        this.since = now;
      }
      if (frame !== this.frame) this.seek(frame, true);
      requestAnimationFrame(tick);
    };
    requestAnimationFrame(tick);
  }

  began() {
    this.from = this.frame;
    this.since = performance.now();
  }

  showPlaying() {
    const title = this.playing ? "Pause (space)" : "Play (space)";
    face(this.playButton, this.playing ? "pause" : "play");
    this.playButton.title = title;
    this.playButton.setAttribute("aria-label", title);
    this.playButton.setAttribute("aria-pressed", String(this.playing));
  }
}
