// Light and dark: as the system has it until the button is used.
const PALETTES = {
  light: ["#0072b2", "#d55e00", "#009e73", "#b3568c", "#b57b00", "#2f8fc4"],
  dark: ["#56b4e9", "#f08a3c", "#35c79a", "#e091bf", "#f0c04a", "#8fd0f5"]
};
const darkSystem = window.matchMedia("(prefers-color-scheme: dark)");
const stillSystem = window.matchMedia("(prefers-reduced-motion: reduce)");
let chosenTheme = motion.theme || null, look = null;
const themeUsers = [];

function readTheme() {
  const name = chosenTheme || (darkSystem.matches ? "dark" : "light");
  document.documentElement.dataset.theme = name;
  const style = getComputedStyle(document.documentElement);
  look = { name: name, palette: PALETTES[name] };
  ["paper", "sky", "ink", "quiet", "line", "accent", "event"].forEach(function (key) {
    look[key] = style.getPropertyValue("--" + key).trim();
  });
  themeUsers.forEach(function (use) { use(); });
}
function switchTheme() {
  chosenTheme = look.name === "dark" ? "light" : "dark";
  readTheme();
  say(chosenTheme === "dark" ? "Dark." : "Light.");
}
function mixColours(first, second, part) {
  return "#" + [1, 3, 5].map(function (k) {
    const a = parseInt(first.substr(k, 2), 16), b = parseInt(second.substr(k, 2), 16);
    return Math.round(a + part * (b - a)).toString(16).padStart(2, "0");
  }).join("");
}
function colourOf(index, count) {
  // Long chains: an ordered ramp from blue to orange, not a carousel of colours.
  if (count <= look.palette.length || motion.links.length <= look.palette.length) {
    return look.palette[index % look.palette.length];
  }
  return mixColours(look.palette[0], look.palette[1], Math.min(1, index / (motion.links.length - 1)));
}
function colourOfMuscle(active) {
  return mixColours(look.name === "dark" ? "#7d4a47" : "#dfa39d", look.name === "dark" ? "#ff6b5e" : "#b3261e", active);
}
darkSystem.addEventListener("change", readTheme);
