/* Begins the players in the cells of a notebook, each in a shadow root: neither styles nor names meet others'.
 * A cell has its still inside, which is seen until the player is there, or where no script runs.
 */
const begin = async (cell) => {
  const shadow = cell.attachShadow({mode: "open"});
  shadow.append(document.createElement("slot"));
  const packed = Uint8Array.from(atob(cell.dataset.movimentumFilm), (letter) => letter.charCodeAt(0));
  const plain = new Blob([packed]).stream().pipeThrough(new DecompressionStream("deflate"));
  const film = JSON.parse(await new Response(plain).text());
  const style = document.createElement("style"), element = document.createElement("div");
  style.textContent = STYLE;
  shadow.replaceChildren(style, element);
  cell.player = film.live ? new MovimentumFigure(element, film, MOVIMENTUM_LIVE, element)
    : new MovimentumPlayer(element, film, element);
};
if (typeof DecompressionStream === "function") {
  for (const cell of document.querySelectorAll(CELLS)) if (!cell.shadowRoot) begin(cell);
}
