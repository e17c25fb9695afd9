/* Begins the players of a page. */
for (const data of document.querySelectorAll("script[data-movimentum]")) {
  const element = document.getElementById(data.dataset.movimentum), film = JSON.parse(data.textContent);
  const player = film.live ? new MovimentumFigure(element, film, MOVIMENTUM_LIVE) : new MovimentumPlayer(element, film);
  window.movimentum = window.movimentum || player;
}
