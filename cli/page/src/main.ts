// SPDX-License-Identifier: Apache-2.0
// Wires the page together.
import { isPlaced, type JournalEntry, type Me, type PhotoDetails, type Removal } from "./answers";
import { Api, ConnectionLost, Problem } from "./api";
import { City } from "./city";
import { CityView } from "./city_view";
import { el, sayAgain } from "./dom";
import { EraseForm } from "./erase_form";
import { followJournal } from "./events";
import { LayerSwitch } from "./layer_switch";
import { buildLayout } from "./layout";
import { takeLink } from "./link";
import { ContributePanel } from "./panel_contribute";
import { HistoryPanel } from "./panel_history";
import { PhotoPanel } from "./panel_photo";
import { PhotosPanel } from "./panel_photos";
import { ReconstructionsPanel } from "./panel_reconstructions";
import { ReportsPanel } from "./panel_reports";
import { SeamsPanel } from "./panel_seams";
import { pinholeOf } from "./photo_plane";
import { PlanLegend } from "./plan_legend";
import { ReportForm } from "./report_form";
import { ShownModel } from "./shown_model";
import { StatusLine } from "./status_line";
import { SurfaceLayer } from "./surface_layer";
import { Tabs } from "./tabs";
import { TokenForm } from "./token_form";
import { currentLanguage, setLanguage, t } from "./words";

// What these do changes nothing that the page shows besides the journal.
const QUIET_ACTIONS = new Set(["vocabulary", "token", "report", "dismiss"]);
// What these do changes which reports wait.
const REPORT_ACTIONS = new Set(["report", "dismiss", "hide", "remove"]);
const PHOTO_SIDE_PX = 2048; // of a photo that is laid over the model

const tokenForm = new TokenForm(() => {
  api.token = null;
  location.reload();
});
const api: Api = new Api((detail) => tokenForm.ask(api.token !== null, detail));
const link = takeLink();
if (link !== null) api.token = link;
// A link that is opened where the page is shown already loads nothing by itself.
window.addEventListener("hashchange", () => {
  const next = takeLink();
  if (next === null) return;
  api.token = next;
  location.reload();
});
const status = new StatusLine();
const tell = (error: unknown) => status.tellError(error);
const city = new City(api, tell, () => status.regain());

const photos = new PhotosPanel(city, select);
const reconstructions = new ReconstructionsPanel(city, showReconstruction);
const seams = new SeamsPanel(city, showReconstruction);
const history = new HistoryPanel(api, city, select, tell);
const contribute = new ContributePanel(api, city, {
  select,
  onDropped: showContribute,
  onJudged: () => city.readSoon(),
});
const reportForm = new ReportForm((id, reason, text) => void report(id, reason, text));
const eraseForm = new EraseForm((id, why) => void erase(id, why));
const reports = new ReportsPanel(api, { select, setHidden, onError: tell });
const photo = new PhotoPanel(api, city, {
  select,
  showReconstruction,
  fly: (details) => void fly(details),
  report: (id) => reportForm.ask(id),
  setHidden: (id, isHidden) => setHidden(id, isHidden).catch(tell),
  erase: (id, name) => eraseForm.ask(id, name),
  close: () => deselect(),
});
const tabs = new Tabs([
  { name: "photos", words: "tab_photos", content: photos.element },
  { name: "reconstructions", words: "tab_reconstructions", content: reconstructions.element },
  { name: "seams", words: "tab_seams", content: seams.element },
  { name: "history", words: "tab_history", content: history.element },
  { name: "contribute", words: "tab_contribute", content: contribute.element },
  { name: "reports", words: "tab_reports", content: reports.element },
]);
tabs.setShown("reports", false);
document.body.append(reportForm.element, eraseForm.element);
const empty = el("p", { class: "view-note", words: "empty" });
empty.hidden = true;
const layers = new LayerSwitch((chosen) => {
  if (view) view.layers = chosen;
});
const legend = new PlanLegend();
const layout = buildLayout({
  tabs,
  photo: photo.element,
  status: status.element,
  note: empty,
  layers: layers.element,
  legend: legend.element,
  dialog: tokenForm.element,
  onLanguage: switchLanguage,
  onToken: () => void changeToken(),
  onOverview: () => view?.overview(),
  onPlan: () => view?.togglePlan(),
  onLeave: () => view?.leavePhoto(),
  onOpacity: (share) => {
    if (view) view.photoOpacity = share;
  },
});
const surface = new SurfaceLayer(api);
const view = makeView();
const shown = new ShownModel(api, city, view, surface, onShown, tell);
surface.onChange = () => {
  layers.element.hidden = !surface.exists;
  view?.requestRender();
};
layout.onInsets = (right, bottom) => view?.setInsets(right, bottom);
layout.fit();

let selected: number | null = null;
let erasing: number | null = null; // not asked about any more
let cameFrom: Element | null = null; // what had the focus when a photo was selected

function makeView(): CityView | null {
  try {
    const made = new CityView(layout.view, surface, legend);
    made.layers = layers.layers;
    made.onPick = select;
    made.onMode = (isInPhoto) => layout.setInPhoto(isInPhoto);
    made.onPlan = (isInPlan) => layout.setInPlan(isInPlan);
    return made;
  } catch {
    layout.view.append(el("p", { class: "view-note", words: "no_webgl" }));
    layout.overview.hidden = true;
    layout.plan.hidden = true;
    document.body.classList.add("no-view");
    return null;
  }
}

function onShown(id: number | null): void {
  layout.view.dataset.reconstruction = id === null ? "" : String(id);
  empty.hidden = id !== null || view === null;
  reconstructions.setShown(id);
}

function showReconstruction(id: number): void {
  view?.leavePhoto(false);
  void shown.choose(id);
}

function select(id: number): void {
  if (selected === null) cameFrom = document.activeElement;
  if (selected !== id) view?.leavePhoto();
  selected = id;
  layout.unfold();
  layout.setHasPhoto(true);
  photos.select(id);
  const known = city.byId.get(id);
  if (known && isPlaced(known)) void shown.choose(known.reconstruction);
  view?.select(id, new Set());
  void showDetails(id);
}

async function showDetails(id: number): Promise<void> {
  try {
    const details = await photo.show(id);
    if (details) view?.select(id, new Set(details.neighbors.map((one) => one.id)));
  } catch (error) {
    if (selected !== id) return;
    tell(error);
    // A photo that was removed is shown no longer.
    if (error instanceof Problem && error.status === 404) deselect();
  }
}

function deselect(): void {
  view?.leavePhoto();
  selected = null;
  view?.select(null, new Set());
  photos.select(null);
  void photo.show(null);
  layout.setHasPhoto(false);
  if (cameFrom instanceof HTMLElement && cameFrom.isConnected) cameFrom.focus();
  else document.querySelector<HTMLElement>('[role="tab"][aria-selected="true"]')?.focus();
  cameFrom = null;
}

async function fly(details: PhotoDetails): Promise<void> {
  try {
    const blob = await api.blob(`/v1/photos/%23${details.id}/thumbnail?side=${PHOTO_SIDE_PX}`);
    const bitmap = await createImageBitmap(blob);
    const find = () => (selected === details.id ? city.byId.get(details.id) : undefined);
    const model = find()?.reconstruction ?? null;
    // The photo's own model may have made way for another one, or may be on its way still.
    const isShown = model !== null && (await shown.choose(model));
    const known = find();
    if (!isShown || !known || !isPlaced(known) || known.reconstruction !== model) {
      return bitmap.close();
    }
    const pinhole = pinholeOf(details, city.cameras.find((camera) => camera.id === details.camera));
    layout.foldWhenNarrow();
    view?.enterPhoto(known, pinhole, bitmap, layout.opacity);
  } catch (error) {
    tell(error);
  }
}

async function report(id: number, reason: string, text: string): Promise<void> {
  try {
    await api.send(`/v1/photos/%23${id}/report`, { reason, text });
    status.tell(t("report_sent"));
  } catch (error) {
    tell(error);
  }
}

async function setHidden(id: number, isHidden: boolean): Promise<void> {
  await api.send(isHidden ? "/v1/hidden" : "/v1/shown", { photos: [`#${id}`] });
  city.readSoon();
}

async function erase(id: number, why: string): Promise<void> {
  status.tell(t("erasing"));
  erasing = id;
  try {
    const answer = await api.send<Removal>("/v1/removals", { photos: [`#${id}`], why });
    if (selected === id) deselect();
    const done = answer.purged ? t("erased") : t("erased_later", { why: answer.why_not ?? "" });
    const copies = answer.copies.join(", ");
    status.tell(copies === "" ? done : `${done} ${t("erased_copies", { copies })}`);
    city.readSoon();
  } catch (error) {
    tell(error);
  } finally {
    erasing = null;
  }
}

// Curators have one list more, and more buttons.
async function findRole(): Promise<void> {
  const { role } = await api.json<Me>("/v1/me");
  photo.isCurated = role === "curator" || role === "admin";
  tabs.setShown("reports", photo.isCurated);
  if (photo.isCurated) await reports.read();
  photo.render();
}

function switchLanguage(): void {
  setLanguage(currentLanguage() === "de" ? "en" : "de");
  document.documentElement.lang = currentLanguage();
  sayAgain();
  const panels = [photos, reconstructions, seams, history, contribute, reports, photo];
  for (const panel of panels) panel.render();
  view?.requestRender();
}

function showContribute(): void {
  if (selected !== null) deselect();
  layout.unfold();
  tabs.open("contribute");
}

async function changeToken(): Promise<void> {
  if ((await api.askOnce()) !== null) location.reload();
}

document.addEventListener("keydown", (event) => {
  if (event.key !== "Escape" || tokenForm.element.open || reportForm.element.open) return;
  if (view?.isInPhoto) view.leavePhoto();
  else if (selected !== null) deselect();
});

city.onChange(() => {
  if (selected !== null && selected !== erasing) void showDetails(selected);
});

function onEntry(entry: JournalEntry): void {
  history.add(entry);
  if (photo.isCurated && REPORT_ACTIONS.has(entry.action)) void reports.read();
  if (!QUIET_ACTIONS.has(entry.action)) city.readSoon();
}

// The journal is found and followed for ever; a start that fails is tried again.
async function follow(): Promise<never> {
  for (;;) {
    try {
      await findRole();
      const last = await history.findLast();
      await history.start(last);
      city.readSoon();
      return await followJournal(api, last, {
        onEntry,
        onConnected: () => {
          status.regain();
          city.readSoon();
        },
        onLost: (error) => {
          const isBusy = error instanceof Problem && error.status === 503;
          if (isBusy) status.tell(t("status_busy"));
          else if (error instanceof Problem) status.tellError(error);
          else status.lose();
        },
      });
    } catch (error) {
      tell(error);
      const pause = error instanceof ConnectionLost ? 3_000 : 10_000;
      await new Promise((resolve) => setTimeout(resolve, pause));
    }
  }
}

document.documentElement.lang = currentLanguage();
contribute.render();
void follow();
