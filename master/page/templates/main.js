/* Puts everything in its place. */
page.write_head();
page.write_comparison();
page.list_signals();
page.write_diagram();
page.write_bonds();
page.write_parameters();
page.listen_to_bar();
page.build();
let width = window.innerWidth;
window.addEventListener("resize", () => {
  if (width !== window.innerWidth) soon("fit", page.fit);
  width = window.innerWidth;
});
window.page = page;
