// SPDX-License-Identifier: Apache-2.0
// What is read from across the room: the phase, whether all is well, who does what next, and what is wrong.
import type {AlignmentStatus, CameraStatus, DaemonStatus, Fault} from './api.gen';
import {act} from './act';
import {el, Keyed, set, setText, show} from './dom';
import {clock, count, fixed, known, short, timeOfDay} from './format';
import type {Connection} from './link';
import {lightWords, phaseWords, showSign, Sign} from './light';
import {call} from './wire';
import {plural, sentence, span} from './format';
import {remedyOf} from './lamp';

class FaultLine {
  private readonly sign = new Sign();
  private readonly kind = el('strong');
  private readonly what = el('span', {class: 'what'});
  private readonly remedy = el('span', {class: 'remedy'});
  private readonly since = el('span', {class: 'note'});
  private readonly button = el('button', {type: 'button'}, 'Acknowledge');
  private lasts?: Fault;
  readonly root = el('li', {class: 'fault'}, this.sign.root, el('p', {}, this.kind, ' ', this.what, ' ', this.remedy), this.since, this.button);

  constructor(private readonly id: number) {
    this.button.addEventListener('click', () => void act(call('Daemon/Acknowledge', {fault_id: this.id})));
  }

  show(fault: Fault, remedy: string, now: number): void {
    this.sign.show(fault.light);
    set(this.root, 'data-light', fault.light);
    set(this.root, 'data-over', fault.over);
    setText(this.kind, `${faultWords(fault.kind)}${fault.subject ? ` (${fault.subject})` : ''}:`);
    setText(this.what, sentence(fault.what));
    setText(this.remedy, remedy && sentence(remedy));
    this.lasts = fault;
    this.tick(now);
    // One that goes on would stay on the list: there is nothing to acknowledge yet.
    show(this.button, fault.over);
  }

  /** For how long it has lasted, as time goes on. */
  tick(now: number): void {
    if (!this.lasts) return;
    const {over, since_utc: since} = this.lasts;
    const seconds = Math.max(0, Math.round((now - Date.parse(since)) / 1000));
    setText(this.since, `since ${timeOfDay(since)}${over ? ', over now' : Number.isFinite(seconds) ? `, ${lasting(seconds)}` : ''}`);
  }
}

/** Whole seconds, then minutes: what counts up needn't say more. */
function lasting(seconds: number): string {
  return seconds < 10 ? `${seconds} s` : span(seconds);
}

/** "3 faults · 10 of 11 cameras film": how much is wrong, where something is. */
export function tally(status: DaemonStatus): string {
  const faults = status.faults.filter(fault => !fault.over).length;
  const films = status.cameras.filter(camera => camera.state === 'FILMING').length;
  return [faults > 0 && plural(faults, 'fault'), films < status.cameras.length && `${films} of ${plural(status.cameras.length, 'camera')} film`].filter(Boolean).join(' · ');
}

/** CAMERA_LOST: "Camera lost". */
export function faultWords(kind: Fault['kind']): string {
  return kind[0] + kind.slice(1).toLowerCase().replaceAll('_', ' ');
}

/** Why this camera is the one: "It is 412 rows (22.2 ms) early; 100 (5.40 ms) are allowed." */
export function resetWhy(camera: CameraStatus | undefined, alignment: AlignmentStatus | undefined): string {
  if (!camera) return '';
  if (!known(camera.error_rows)) return camera.reason;
  const off = `It is ${count(Math.abs(camera.error_rows))} rows (${short(Math.abs(camera.error_s ?? NaN))}) ${camera.error_rows > 0 ? 'early' : 'late'}`;
  return alignment?.tolerance_rows ? `${off}; ${fixed(alignment.tolerance_rows, alignment.tolerance_rows < 9.5 ? 1 : 0)} (${short(alignment.tolerance_s)}) are allowed.` : `${off}.`;
}

export class Header {
  private readonly sign = new Sign();
  private readonly light = el('span', {class: 'light'});
  private readonly phase = el('h1', {}, '…');
  private readonly clock = el('span', {class: 'clock', hidden: true});
  private readonly reason = el('p', {class: 'reason'});
  private readonly next = el('p', {class: 'next-step'});
  private readonly nextTitle = el('span', {class: 'title'}, 'Next');
  private readonly nextBox = el('div', {class: 'next', hidden: true}, this.nextTitle, this.next);
  private readonly rig = el('span', {class: 'rig'});
  private readonly disk = el('span');
  private readonly time = el('time');
  private readonly link = el('span', {class: 'link', 'data-connection': 'connecting'}, 'connecting');
  private readonly faults = el('ul', {class: 'faults', 'aria-label': 'Faults', hidden: true});
  private readonly lines = new Keyed<Fault, FaultLine>(this.faults, id => new FaultLine(Number(id)), (line, fault) => line.show(fault, this.remedy(fault), this.now()));
  private readonly lent = el('div', {class: 'lent', role: 'status', hidden: true});
  private readonly tally = el('span', {class: 'tally'});
  private readonly lost = el('div', {class: 'connection-lost', role: 'alert', hidden: true});
  private readonly live = el('div', {class: 'hidden', 'aria-live': 'assertive', id: 'announcements'});
  private said = '';
  private cameras: CameraStatus[] = [];
  private step = '';
  private clockOffset = 0;  // ms that the daemon's wall clock is ahead of performance.now()
  private lostAt?: number;
  private displaced = false;
  readonly root: HTMLElement;

  constructor() {
    this.root = el('header', {class: 'top'}, this.lost,
      el('div', {class: 'line'},
        el('div', {class: 'phase'}, this.sign.root, el('div', {}, el('div', {class: 'words'}, this.phase, this.clock, this.light, this.tally), this.reason)),
        this.nextBox,
        el('div', {class: 'meta'}, this.link, this.rig, this.disk, this.time)),
      this.lent, this.faults, this.live);
    setInterval(() => {
      this.showLost();
      for (const line of this.lines.views.values()) line.tick(this.now());
    }, 1000);
  }

  show(status: DaemonStatus): void {
    set(this.root, 'data-phase', status.phase);
    set(this.root, 'data-light', status.light);
    showSign(this.sign, this.phase, status.light, phaseWords[status.phase]);
    setText(this.light, lightWords[status.light]);
    show(this.clock, status.phase === 'CAPTURING');
    setText(this.clock, clock(status.recording?.seconds ?? 0));
    this.cameras = status.cameras;
    this.clockOffset = (Date.parse(status.now_utc) || Date.now()) - performance.now();
    setText(this.tally, tally(status));
    // A fault's line says the same, and what to do.
    const told = status.faults.some(fault => !fault.over && fault.what === status.reason);
    show(this.reason, !told);
    setText(this.reason, status.reason);
    this.step = this.nextStep(status);
    const camera = status.alignment?.reset_next;
    const why = resetWhy(status.cameras.find(each => each.id === camera), status.alignment);
    const others = camera ? [] : status.cameras.filter(each => each.reset_next).map(each => each.id);  // by command: nobody has to move
    show(this.nextBox, status.next_step !== '' || Boolean(camera) || others.length > 0);
    set(this.nextBox, 'data-reset', Boolean(camera));
    setText(this.nextTitle, camera ? `Reset ${camera}` : others.length > 0 ? 'Wait' : 'Next');
    setText(this.next, [this.step, why, others.length > 0 && `${others.join(', ')} ${others.length > 1 ? 'are' : 'is'} being reset by command.`].filter(Boolean).join(' '));
    setText(this.rig, [status.rig, status.version && `emberlockd ${status.version}`].filter(Boolean).join(' · '));
    const storage = status.storage;
    setText(this.disk, storage ? `disk ${storage.minutes_left >= 120 ? `${fixed(storage.minutes_left / 60, 1)} h` : `${fixed(storage.minutes_left, 0)} min`}` : '');
    setText(this.time, timeOfDay(status.now_utc));
    show(this.lent, status.lent_to !== '');
    setText(this.lent, status.lent_to && `These cameras are lent to ${status.lent_to}: align and record there.`);
    show(this.faults, status.faults.length > 0);
    this.lines.show([...status.faults].sort((a, b) => Number(a.over) - Number(b.over) || (a.light === b.light ? b.id - a.id : a.light === 'RED' ? -1 : 1)), fault => String(fault.id));
    document.title = `${phaseWords[status.phase]} – Emberlock`;
    this.say(`${phaseWords[status.phase]}.${camera ? ` Reset ${camera}.` : ''}${status.light === 'RED' ? ` ${status.reason}` : ''}`);
  }

  /** Beside the next step, which may be the same, it isn't said again. */
  private remedy(fault: Fault): string {
    const remedy = remedyOf(fault, this.cameras);
    return remedy === this.step ? '' : remedy;
  }

  /** What the daemon says; where it is a fault's remedy, as that is shown. */
  private nextStep(status: DaemonStatus): string {
    const fault = status.faults.find(each => !each.over && each.remedy !== '' && each.remedy === status.next_step);
    return fault ? remedyOf(fault, status.cameras) : status.next_step;
  }

  private now(): number {
    return performance.now() + this.clockOffset;
  }

  connection(state: Connection): void {
    set(this.link, 'data-connection', state);
    setText(this.link, {connecting: 'connecting', open: 'live', lost: 'lost', token: 'not let in', displaced: 'displaced'}[state]);
    this.displaced = state === 'displaced';
    if (state === 'open') this.lostAt = undefined;
    else if (state === 'lost' || state === 'displaced') this.lostAt ??= performance.now();
    set(document.documentElement, 'data-stale', this.lostAt !== undefined);
    this.showLost();
  }

  private showLost(): void {
    show(this.lost, this.lostAt !== undefined);
    if (this.lostAt === undefined) return;
    const since = `${Math.round((performance.now() - this.lostAt) / 1000)} s ago`;
    const text = this.displaced ? `A newer console took this one's place ${since}: the daemon shows so many at a time. What is shown is old. Reload to take it back.`
      : `Connection to emberlockd lost ${since}. What is shown is old. Trying again …`;
    setText(this.lost, text);
    this.say('Connection lost.');
  }

  private say(words: string): void {
    if (words === this.said) return;
    this.said = words;
    setText(this.live, words);
  }
}
