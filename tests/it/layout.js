// Faults of the layout of a page: texts that overlap, are cut off, or stand outside of the window; controls without a name.
return (() => {
  const faults = [], texts = [];
  const name = (element) => `${element.tagName.toLowerCase()}${element.id ? "#" + element.id : ""}`;
  const visible = (element) => element.checkVisibility({ visibilityProperty: true, opacityProperty: true });
  const scrolls = (element) => /auto|scroll/.test(getComputedStyle(element).overflow);
  const walker = document.createTreeWalker(document.body, NodeFilter.SHOW_TEXT);
  for (let node = walker.nextNode(); node; node = walker.nextNode()) {
    const owner = node.parentElement;
    if (!node.data.trim() || /^(SCRIPT|STYLE|OPTION|SELECT|NOSCRIPT)$/.test(owner.tagName) || !visible(owner)) continue;
    const range = document.createRange();
    range.selectNodeContents(node);
    // what a scrolled box hides is not on the page
    let box = null;
    for (let parent = owner; parent && !box; parent = parent.parentElement) if (scrolls(parent) && parent !== document.body) box = parent;
    const frame = box?.getBoundingClientRect();
    for (const rect of range.getClientRects()) {
      const outside = frame && (rect.top < frame.top || rect.bottom > frame.bottom || rect.left < frame.left || rect.right > frame.right);
      if (rect.width && !outside) texts.push({ rect, owner, text: node.data.trim() });
    }
  }
  for (const { rect, owner, text } of texts) {
    if (rect.left < -1 || rect.right > document.documentElement.clientWidth + 1) faults.push(`outside: ${name(owner)} “${text}”`);
    for (let parent = owner; parent && parent !== document.body; parent = parent.parentElement) {
      const frame = parent.getBoundingClientRect();
      if (getComputedStyle(parent).overflow !== "hidden") continue;
      if (rect.right > frame.right + 2 || rect.left < frame.left - 2 || rect.bottom > frame.bottom + 2 || rect.top < frame.top - 2) {
        faults.push(`cut: ${name(owner)} “${text}” in ${name(parent)}`);
      }
    }
  }
  const sticky = (element) => element.closest("th");
  texts.forEach((a, k) => texts.slice(k + 1).forEach((b) => {
    const across = Math.min(a.rect.right, b.rect.right) - Math.max(a.rect.left, b.rect.left);
    const down = Math.min(a.rect.bottom, b.rect.bottom) - Math.max(a.rect.top, b.rect.top);
    if (across > 2 && down > 4 && !sticky(a.owner) && !sticky(b.owner)) faults.push(`overlap: “${a.text}” and “${b.text}”`);
  }));
  for (const control of document.querySelectorAll("button, select, input, [tabindex]")) {
    const label = control.ariaLabel || control.labels?.[0]?.innerText || control.innerText || control.placeholder;
    if (visible(control) && !label?.trim()) faults.push(`no name: ${name(control)}`);
  }
  const page = document.documentElement;
  if (page.scrollWidth > page.clientWidth + 1) faults.push(`the page is ${page.scrollWidth} px wide in a window of ${page.clientWidth}`);
  return faults;
})();
