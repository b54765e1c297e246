// SPDX-License-Identifier: Apache-2.0
// Cameras of several hosts as one rig: each other host that this one leads, or who leads this one's cameras; and what each keeps of a recording.
import type {DaemonStatus, HostPart, HostPart_State, HostStatus, Light, RecordingStatus} from './api.gen';
import {el, Keyed, set, setText, show} from './dom';
import {count, fixed, known, plural, sentence, short} from './format';
import {lightWords, showSign, Sign} from './light';

/** Its clock against this one's: "5.000 s ahead ± 80 µs". */
export function clockWords(ahead: number, sigma: number): string {
  const size = Math.abs(ahead);
  return `${size < 0.9995 ? short(size) : `${fixed(size, 3)} s`} ${ahead < 0 ? 'behind' : 'ahead'} ± ${short(sigma)}`;
}

/** "3 cameras · clock 5.000 s ahead ± 80 µs · round trip 160 µs". */
export function hostWords(host: HostStatus): string {
  return [plural(host.cameras, 'camera'), known(host.clock_ahead_s) && `clock ${clockWords(host.clock_ahead_s, host.clock_sigma_s)}`,
          host.connected && host.round_trip_s > 0 && `round trip ${short(host.round_trip_s)}`].filter(Boolean).join(' · ');
}

/** A host's name without its port, where that tells it from the others: tiles are narrow. */
export function shortHost(host: string, hosts: readonly HostStatus[]): string {
  const name = (full: string) => full.replace(/:\d+$/, '');
  return hosts.some(other => other.host !== host && name(other.host) === name(host)) ? host : name(host);
}

const parts: Record<HostPart_State, [Light, string]> = {
  STATE_UNSPECIFIED: ['LIGHT_UNSPECIFIED', 'unknown'],
  RECORDING: ['GREEN', 'recording'],
  MISSING: ['AMBER', 'missing'],
  WHOLE: ['GREEN', 'whole'],
  SHORT: ['RED', 'short'],
};

/** "3 cameras, 240 frames, none lost", as far as it is known. */
export function partWords(part: HostPart): string {
  const told = part.state === 'WHOLE' || part.frames + part.lost > 0;
  return [plural(part.camera_ids.length, 'camera'), told && plural(part.frames, 'frame'), told && (part.lost > 0 ? `${count(part.lost)} lost` : 'none lost')].filter(Boolean).join(', ');
}

/** A sign, a name, a word, and below them what is known and why it is so. */
class Line {
  private readonly sign = new Sign();
  private readonly word = el('span', {class: 'word'});
  private readonly facts = el('p', {class: 'note'});
  private readonly wanting = el('p', {class: 'wanting'});
  private readonly reason = el('p', {class: 'reason'});
  readonly root: HTMLElement;

  constructor(name: string) {
    this.root = el('li', {'data-host': name}, el('div', {}, this.sign.root, el('strong', {}, el('bdi', {}, name)), this.word), this.facts, this.wanting, this.reason);
  }

  show(light: Light, word: string, facts: string, reason: string, wanting = 0): void {
    set(this.root, 'data-light', light);
    showSign(this.sign, this.word, light, word);
    setText(this.facts, facts);
    show(this.wanting, wanting > 0);
    setText(this.wanting, `${plural(wanting, 'part')} of recordings wanting`);
    show(this.reason, reason !== '');
    setText(this.reason, reason && sentence(reason));
  }
}

/** What other hosts record of a session. */
export class Parts {
  private readonly list = el('ul', {class: 'host-lines'});
  private readonly lines = new Keyed<HostPart, Line>(this.list, name => new Line(name), (line, part) =>
    line.show(...parts[part.state], partWords(part), part.why));
  readonly root = el('div', {class: 'parts', hidden: true}, el('h3', {}, 'Other hosts’ parts'), this.list);

  show(recording: RecordingStatus | undefined): void {
    const hosts = recording?.hosts ?? [];
    show(this.root, hosts.length > 0);
    this.lines.show(hosts, part => part.host);
  }
}

export class Hosts {
  private readonly note = el('span', {class: 'note'});
  private readonly lent = el('p', {class: 'lent-to'});
  private readonly list = el('ul', {class: 'host-lines'});
  private readonly lines = new Keyed<HostStatus, Line>(this.list, name => new Line(name), (line, host) =>
    line.show(host.light, !host.connected ? 'not connected' : host.light === 'GREEN' ? 'connected' : `connected, ${lightWords[host.light]}`,
              hostWords(host), host.light === 'GREEN' ? '' : host.reason, host.parts_wanting));
  readonly root = el('section', {id: 'hosts', class: 'panel', 'aria-labelledby': 'hosts-title', hidden: true},
    el('header', {}, el('h2', {id: 'hosts-title'}, 'Hosts'), this.note), this.lent, this.list);

  show(status: DaemonStatus): void {
    const {hosts, lent_to} = status;
    show(this.root, hosts.length > 0 || lent_to !== '');
    const connected = hosts.filter(host => host.connected).length;
    setText(this.note, hosts.length === 0 ? '' : connected === hosts.length ? 'all connected' : `${connected} of ${hosts.length} connected`);
    show(this.lent, lent_to !== '');
    setText(this.lent, lent_to && `Lends its cameras to ${lent_to}.`);
    show(this.list, hosts.length > 0);
    this.lines.show(hosts, host => host.host);
  }
}
