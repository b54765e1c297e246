// SPDX-License-Identifier: Apache-2.0
// The grid of all cameras, and one of them enlarged.
import type {DaemonStatus} from './api.gen';
import {arrange, wordsBelow, wordsBeside} from './arrange';
import {el, Keyed, set, setText, show} from './dom';
import {Enlarged} from './enlarged';
import {plural} from './format';
import {shortHost} from './hosts';
import {cameraWithFlame} from './live_flame';
import {Tile} from './tile';
import type {Picture} from './wire';

const kTileRate = 12;      // pictures a second of each camera in the grid
const kEnlargedRate = 24;  // of one that is enlarged

export class Cameras {
  private readonly grid = el('div', {class: 'grid'});
  private readonly none = el('p', {class: 'empty', hidden: true}, 'The rig has no cameras. The configuration names them.');
  private readonly summary = el('span', {class: 'note'});
  readonly root = el('section', {id: 'cameras', 'aria-label': 'Cameras'}, el('h2', {class: 'hidden'}, 'Cameras ', this.summary), this.grid, this.none);
  readonly enlarged = new Enlarged(() => this.wish());
  private readonly tiles = new Keyed<DaemonStatus['cameras'][number], Tile>(this.grid, id => this.make(id), (tile, camera) =>
    tile.show(camera, this.status?.alignment?.tolerance_s || undefined, camera.id === this.status?.alignment?.reset_next,
              this.status !== undefined && cameraWithFlame(this.status) === camera.id, shortHost(camera.host, this.status?.hosts ?? [])));
  private readonly visible = new Set<string>();
  private readonly sight = new IntersectionObserver(entries => {
    for (const entry of entries) {
      const id = (entry.target as HTMLElement).dataset.camera!;
      if (entry.isIntersecting) this.visible.add(id);
      else this.visible.delete(id);
    }
    this.wish();
  }, {rootMargin: '100px'});
  private status?: DaemonStatus;

  constructor(private readonly watch: (wanted: {camera_ids: string[]; rate_hz: number} | null) => void) {
    new ResizeObserver(() => this.arrange()).observe(this.grid);
    document.addEventListener('visibilitychange', () => this.wish());
    this.grid.addEventListener('keydown', event => this.step(event));
  }

  show(status: DaemonStatus): void {
    this.status = status;
    // Who is to be reset by hand comes first; the others stay where they are.
    const next = status.alignment?.reset_next;
    const cameras = [...status.cameras].sort((a, b) => Number(b.id === next) - Number(a.id === next));
    this.tiles.show(cameras, camera => camera.id);
    const known = new Set(cameras.map(camera => camera.id));
    for (const id of this.visible) if (!known.has(id)) this.visible.delete(id);
    show(this.none, cameras.length === 0);
    setText(this.summary, plural(cameras.length, 'camera'));
    this.enlarged.show(status);
    this.arrange();
  }

  offer(header: Picture, jpeg: Uint8Array): void {
    const tile = this.tiles.views.get(header.camera_id);
    if (!tile) return;
    if (this.enlarged.id === header.camera_id) this.enlarged.picture.offer(header, jpeg);
    else tile.picture.offer(header, jpeg);
  }

  restart(): void {
    for (const tile of this.tiles.views.values()) tile.picture.restart();
    this.enlarged.picture.restart();
  }

  /** To the camera that is to be reset; false if there is none. */
  focusNext(): boolean {
    const next = this.status?.cameras.find(camera => camera.reset_next);
    const tile = next && this.tiles.views.get(next.id);
    tile?.root.focus();
    return tile !== undefined;
  }

  private make(id: string): Tile {
    const tile = new Tile(id, which => this.enlarged.open(which));
    this.sight.observe(tile.root);
    return tile;
  }

  private wish(): void {
    if (document.hidden) this.watch(null);
    else if (this.enlarged.id !== undefined) this.watch({camera_ids: [this.enlarged.id], rate_hz: kEnlargedRate});
    else if (this.visible.size === 0) this.watch(null);
    else if (this.visible.size === this.tiles.views.size) this.watch({camera_ids: [], rate_hz: kTileRate});
    else this.watch({camera_ids: [...this.visible].sort(), rate_hz: kTileRate});
  }

  private arrange(): void {
    const cameras = this.status?.cameras ?? [];
    if (cameras.length === 0) return;
    const {width, height} = this.grid.getBoundingClientRect();
    const first = cameras[0]!;
    const aspect = first.width > 0 && first.height > 0 ? first.width / first.height : 4 / 3;
    const fills = getComputedStyle(this.grid).getPropertyValue('--fills') === '1';
    // One cell more: the camera to be reset next takes two.
    const {columns, beside} = fills ? arrange(cameras.length + 1, width, height, aspect) : {columns: Math.max(2, Math.min(8, Math.floor(width / 260))), beside: false};
    set(this.grid, 'data-columns', columns);
    set(this.grid, 'data-beside', beside);
    this.grid.style.setProperty('--words-below', `${wordsBelow(width / columns)}px`);
    this.grid.style.setProperty('--words-beside', `${wordsBeside(height / Math.ceil((cameras.length + 1) / columns))}px`);
  }

  // Arrow keys go from tile to tile.
  private step(event: KeyboardEvent): void {
    const columns = Number(this.grid.dataset.columns ?? 1);
    const by = {ArrowLeft: -1, ArrowRight: 1, ArrowUp: -columns, ArrowDown: columns}[event.key];
    if (by === undefined || event.altKey || event.ctrlKey || event.metaKey) return;
    const all = [...this.grid.children] as HTMLElement[];
    const to = all[all.indexOf(document.activeElement as HTMLElement) + by];
    if (!to) return;
    event.preventDefault();
    to.focus();
  }
}
