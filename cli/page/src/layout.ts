// SPDX-License-Identifier: Apache-2.0
// The frame of the page: the view fills the window; the lists lie at its right, or at its bottom
// where the window is narrow, and can be folded.
import { el } from "./dom";
import type { Tabs } from "./tabs";

interface Parts {
  tabs: Tabs;
  photo: HTMLElement;
  status: HTMLElement;
  note: HTMLElement;
  layers: HTMLElement;
  legend: HTMLElement;
  dialog: HTMLElement;
  onLanguage(): void;
  onToken(): void;
  onOverview(): void;
  onPlan(): void;
  onLeave(): void;
  onOpacity(share: number): void;
}

export interface Layout {
  view: HTMLElement;
  overview: HTMLButtonElement;
  plan: HTMLButtonElement;
  readonly opacity: number;
  // Panels cover so many px of the view.
  onInsets: (right: number, bottom: number) => void;
  fit(): void;
  unfold(): void;
  foldWhenNarrow(): void;
  setHasPhoto(has: boolean): void;
  setInPhoto(isInPhoto: boolean): void;
  setInPlan(isInPlan: boolean): void;
}

const NARROW = matchMedia("(max-width: 720px)");

export function buildLayout(parts: Parts): Layout {
  const skip = el("a", { class: "skip", words: "skip", attributes: { href: "#panel" } });
  const view = el("div", {
    id: "view",
    label: "view",
    attributes: { tabindex: "0", role: "application" },
  });
  const overview = el("button", { words: "overview", onClick: parts.onOverview });
  const plan = el("button", {
    id: "plan",
    words: "plan",
    attributes: { "aria-pressed": "false" },
    onClick: parts.onPlan,
  });
  const slider = el("input", {
    id: "opacity",
    attributes: { type: "range", min: "0", max: "100", value: "80" },
  });
  const leave = el("button", { id: "leave", words: "leave", onClick: parts.onLeave });
  const sliderLabel = el("label", { words: "opacity", attributes: { for: "opacity" } });
  const photoBar = el("div", { class: "bar photo-bar" }, sliderLabel, slider, leave);
  photoBar.hidden = true;
  const bar = el("div", { class: "bar" }, overview, plan, parts.layers);
  const overlay = el(
    "div",
    { class: "overlay" },
    parts.note,
    parts.legend,
    photoBar,
    bar,
    parts.status,
  );
  const main = el("main", {}, view, overlay);

  const foldButton = el("button", { id: "fold", label: "fold", class: "fold" });
  const head = el(
    "header",
    {},
    el("h1", {}, "Veduta"),
    el("button", { id: "language", words: "language", onClick: parts.onLanguage }),
    el("button", { id: "token-button", words: "token_button", onClick: parts.onToken }),
    foldButton,
  );
  const body = el("div", { class: "panel-body" }, parts.tabs.list, parts.tabs.panels, parts.photo);
  const panel = el(
    "aside",
    { id: "panel", label: "panel", attributes: { tabindex: "-1" } },
    head,
    body,
  );
  document.body.append(skip, main, panel, parts.dialog);

  const layout: Layout = {
    view,
    overview,
    plan,
    get opacity() {
      return Number(slider.value) / 100;
    },
    onInsets: () => {},
    fit() {
      const box = panel.getBoundingClientRect();
      const isOpen = !panel.classList.contains("folded");
      const right = NARROW.matches || !isOpen ? 0 : box.width;
      const bottom = NARROW.matches ? box.height : 0;
      overlay.style.right = `${right}px`;
      overlay.style.bottom = `${bottom}px`;
      layout.onInsets(right, bottom);
    },
    unfold: () => setFolded(false),
    foldWhenNarrow() {
      if (NARROW.matches) setFolded(true);
    },
    setHasPhoto(has) {
      parts.tabs.list.hidden = has;
      parts.tabs.panels.hidden = has;
    },
    setInPhoto(isInPhoto) {
      const hadFocus = photoBar.contains(document.activeElement);
      photoBar.hidden = !isInPhoto;
      bar.hidden = isInPhoto;
      if (isInPhoto) leave.focus();
      else if (hadFocus) view.focus({ preventScroll: true });
    },
    setInPlan: (isInPlan) => plan.setAttribute("aria-pressed", String(isInPlan)),
  };

  function setFolded(isFolded: boolean): void {
    panel.classList.toggle("folded", isFolded);
    body.hidden = isFolded;
    foldButton.setAttribute("aria-expanded", String(!isFolded));
    layout.fit();
  }
  foldButton.addEventListener("click", () => setFolded(!panel.classList.contains("folded")));
  slider.addEventListener("input", () => parts.onOpacity(layout.opacity));
  new ResizeObserver(() => layout.fit()).observe(panel);
  NARROW.addEventListener("change", () => layout.fit());
  setFolded(NARROW.matches && innerHeight < 600);
  return layout;
}
