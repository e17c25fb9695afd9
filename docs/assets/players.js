// The gallery: scripts are open, and a button puts the player in a film's place. Without this, the films play as GIFs.
document.querySelectorAll(".film").forEach((film) => {
  film.querySelectorAll("details").forEach((details) => (details.open = true));
  const picture = film.querySelector("img");
  if (!picture) return;
  const button = document.createElement("button");
  button.textContent = "with a player";
  button.className = "film-player";
  button.addEventListener("click", () => {
    const frame = document.createElement("iframe");
    frame.src = picture.src.replace(/\.gif$/, ".html");
    frame.title = picture.alt;
    frame.height = Math.round((picture.clientWidth * picture.naturalHeight) / picture.naturalWidth) + 60;
    picture.replaceWith(frame);
    button.remove();
  });
  picture.after(document.createElement("br"), button);
});
