// Light or dark: what the reader chose last, or else the system's. It is in every page, after all that draws.
{
  const root = document.documentElement, button = document.getElementById("theme"), system = matchMedia("(prefers-color-scheme: dark)");
  const rules = [...document.styleSheets].flatMap((sheet) => [...sheet.cssRules]).filter((rule) => rule.media?.mediaText.includes("prefers-color-scheme"));
  let dark = system.matches;
  const name = () => { if (button) button.textContent = dark ? "Light" : "Dark"; };
  const apply = () => {
    for (const { media } of rules) media.mediaText = dark ? "screen" : "not all";
    root.style.colorScheme = dark ? "dark" : "light";
    document.dispatchEvent(new Event("theme"));
    name();
  };
  const kept = (value) => {
    try { // a page in a frame, or without storage, forgets it
      if (value) localStorage.setItem("bridgegen-theme", value);
      return localStorage.getItem("bridgegen-theme");
    } catch { return null; }
  };
  if (button) {
    const chosen = kept();
    if (chosen && (chosen === "dark") !== dark) { dark = !dark; apply(); }
    name();
    button.hidden = false;
    button.addEventListener("click", () => { dark = !dark; kept(dark ? "dark" : "light"); apply(); });
  }
  system.addEventListener("change", () => { dark = system.matches; apply(); });
}
