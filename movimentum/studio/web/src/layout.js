/* The width of the script's side. */
import {byId} from "./dom.js";

const LEAST = 20, MOST = 75, STEP = 2; // percent of the page

export function splitter() {
  const bar = byId("splitter"), main = bar.parentElement;
  let part = Number(kept()) || 38;
  const put = (wanted) => {
    part = Math.min(MOST, Math.max(LEAST, wanted));
    main.style.setProperty("--left", `${part}%`);
    bar.setAttribute("aria-valuenow", String(Math.round(part)));
    kept(String(part));
  };
  bar.setAttribute("aria-valuemin", String(LEAST));
  bar.setAttribute("aria-valuemax", String(MOST));
  put(part);
  bar.addEventListener("pointerdown", (event) => {
    bar.setPointerCapture(event.pointerId);
    const move = (each) => put(100 * each.clientX / main.clientWidth);
    bar.addEventListener("pointermove", move);
    bar.addEventListener("lostpointercapture", () => bar.removeEventListener("pointermove", move), {once: true});
    event.preventDefault();
  });
  bar.addEventListener("dblclick", () => put(38));
  bar.addEventListener("keydown", (event) => {
    const way = {ArrowLeft: -1, ArrowRight: 1}[event.key];
    if (!way) return;
    put(part + way * STEP);
    event.preventDefault();
    event.stopPropagation();
  });
}

/* What the browser keeps for the next time; in some places it keeps nothing. */
function kept(value = null) {
  try {
    if (value !== null) window.localStorage.setItem("left", value);
    return window.localStorage.getItem("left");
  } catch {
    return null;
  }
}
