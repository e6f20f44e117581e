// Light, dark, or as the system says; remembered where the browser allows it.
const theme = (() => {
  const system = matchMedia("(prefers-color-scheme: dark)"), listeners = [];
  let chosen = "auto", printing = false;
  try { chosen = localStorage.getItem("ncfix-theme") || "auto"; } catch { /* not remembered */ }
  const apply = () => {
    const dark = !printing && (chosen === "dark" || (chosen === "auto" && system.matches));
    document.documentElement.dataset.theme = dark ? "dark" : "light";
    listeners.forEach(each => each());
  };
  for (const input of document.querySelectorAll("input[name=theme]")) {
    input.checked = input.value === chosen;
    input.addEventListener("change", () => {
      chosen = input.value;
      try { localStorage.setItem("ncfix-theme", chosen); } catch { /* not remembered */ }
      apply();
    });
  }
  system.addEventListener("change", apply);
  addEventListener("beforeprint", () => { printing = true; apply(); });
  addEventListener("afterprint", () => { printing = false; apply(); });
  apply();
  return { get dark() { return document.documentElement.dataset.theme === "dark"; }, changed: each => listeners.push(each) };
})();
const ink = name => getComputedStyle(document.documentElement).getPropertyValue(`--${name}`).trim();
