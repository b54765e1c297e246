// emberlockd in a folder of its own, on a free port of this machine.
import {type ChildProcess, spawn} from 'node:child_process';
import {mkdtempSync, rmSync, writeFileSync} from 'node:fs';
import {createServer} from 'node:net';
import {tmpdir} from 'node:os';
import {join} from 'node:path';

async function freePort(): Promise<number> {
  return new Promise(resolve => {
    const server = createServer().listen(0, '127.0.0.1', () => {
      const {port} = server.address() as {port: number};
      server.close(() => resolve(port));
    });
  });
}

export class Daemon {
  private readonly folder = mkdtempSync(join(tmpdir(), 'emberlock-walk-'));
  private child?: ChildProcess;
  private said = '';
  private ended = false;
  url = '';

  /** `rig` is the configuration's part that tells of cameras and strobe. */
  async start(bin: string, console: string, rig: string): Promise<void> {
    const port = await freePort();
    this.url = `http://127.0.0.1:${port}/`;
    writeFileSync(join(this.folder, 'emberlock.toml'), `${rig}
[recording]
folder = "${this.folder}/sessions"
[reconstruction]
program = "${bin}/emberlock"
voxels = 48
[server]
socket = "${this.folder}/emberlockd.sock"
http_listen = "127.0.0.1:${port}"
console = "${console}"
`);
    this.child = spawn(`${bin}/emberlockd`, ['--config', join(this.folder, 'emberlock.toml')], {stdio: ['ignore', 'pipe', 'pipe']});
    for (const stream of [this.child.stdout!, this.child.stderr!]) stream.on('data', (data: Buffer) => { this.said += data.toString(); });
    this.child.on('exit', () => { this.ended = true; });
    for (const end = Date.now() + 20_000; ; await new Promise(resolve => setTimeout(resolve, 50))) {
      if (await fetch(`${this.url}healthz`).then(answer => answer.ok, () => false)) return;
      if (this.ended || Date.now() > end) throw new Error(`emberlockd did not get ready: ${this.said}`);
    }
  }

  async call<T>(method: string, request: object = {}): Promise<T> {
    const answer = await fetch(`${this.url}api/v1/${method}`, {method: 'POST', headers: {'Content-Type': 'application/json'}, body: JSON.stringify(request)});
    if (!answer.ok) throw new Error(`${method}: ${await answer.text()}`);
    return (await answer.json()) as T;
  }

  get log(): string {
    return this.said;
  }

  kill(): void {
    this.child?.kill('SIGKILL');
  }

  async stop(): Promise<void> {
    if (this.child && !this.ended) {
      this.child.kill('SIGTERM');
      for (const end = Date.now() + 10_000; !this.ended && Date.now() < end;) await new Promise(resolve => setTimeout(resolve, 50));
      this.child.kill('SIGKILL');
    }
    rmSync(this.folder, {recursive: true, force: true});
  }
}
