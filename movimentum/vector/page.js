/* Begins the players of a page. */
for (const data of document.querySelectorAll("script[data-movimentum]")) {
  const player = new MovimentumPlayer(document.getElementById(data.dataset.movimentum), JSON.parse(data.textContent));
  window.movimentum = window.movimentum || player;
}
