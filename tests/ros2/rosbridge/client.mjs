// A client of a bridge by roslib that publishes numbered messages, or waits for some; or a connection without roslib.
//
//     node client.mjs publish PORT TOPIC COUNT BATCH [RATE]
//     node client.mjs wait    PORT TOPIC COUNT BATCH [COMPRESSION]
//     node client.mjs attempt URL [TOKEN] [QUERY]
//     node client.mjs malformed PORT COUNT
//
// `publish` and `wait` connect as soon as somebody listens, and say `matched` then. For each line on its standard input
// a publisher sends a `probe`, which is no message, or for `go` a batch of messages; who waits says `heard` with the
// number of the probe that it has heard, and `count` after each batch. At the end they say as JSON how many messages
// there were, and the digest of what they say; a publisher stays until its input ends. `attempt` says whether it was
// let in, with a token in a header or in the address. `malformed` sends what is no operation, and says how many reports
// it got.

import { createHash } from "node:crypto";
import { createInterface } from "node:readline";
import { Ros, Topic } from "roslib";
import { WebSocket } from "ws";

const TYPE = "sensor_msgs/JointState";
const [part, at, ...rest] = process.argv.slice(2);
const digest = createHash("sha256");
const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

function say(said) {
  console.log(JSON.stringify(said));
}

function end(said) {
  say(said);
  process.exit(0);
}

// What a message says, the same in every language.
function said(content) {
  return `${content.name[0]}:${Array.from(content.position, (position) => Math.round(position * 8)).join(",")};`;
}

async function connected() {
  const ros = new Ros();
  for (let tries = 0; tries < 600; tries += 1) {
    const is = await new Promise((resolve) => {
      ros.once("connection", () => resolve(true));
      ros.once("close", () => resolve(false));
      ros.once("error", () => resolve(false));
      ros.connect(`ws://127.0.0.1:${at}`);
    });
    if (is) return ros;
    await pause(200);
  }
  throw new Error("nobody listens");
}

async function publish([name, count, batch, rate]) {
  const topic = new Topic({ ros: await connected(), name, messageType: TYPE, queue_size: 1000 });
  topic.advertise();
  say({ matched: true });
  let probes = 0, sent = 0;
  for await (const line of createInterface({ input: process.stdin })) {
    if (line === "probe") {
      probes += 1;
      topic.publish({ name: ["probe"], position: [probes], velocity: [], effort: [] });
      continue;
    }
    const begin = Date.now(), first = sent;
    while (sent < Math.min(Number(count), first + Number(batch))) {
      const content = { name: [`j${sent}`], position: [sent / 8, -sent / 4], velocity: [], effort: [] };
      digest.update(said(content));
      topic.publish(content);
      sent += 1;
      const due = rate ? begin + ((sent - first) * 1000) / Number(rate) : 0;
      if (due > Date.now()) await pause(due - Date.now());
    }
  }
  end({ count: sent, digest: digest.digest("hex") });
}

async function wait([name, count, batch, compression = "none"]) {
  const topic = new Topic({ ros: await connected(), name, messageType: TYPE, compression, queue_length: 0 });
  let heard = 0;
  topic.subscribe((content) => {
    if (content.name[0] === "probe") {
      say({ heard: content.position[0] });
      return;
    }
    digest.update(said(content));
    heard += 1;
    if (heard === Number(count)) end({ count: heard, digest: digest.digest("hex") });
    if (heard % Number(batch) === 0) say({ count: heard });
  });
  say({ matched: true });
}

function attempt([token, query]) {
  const headers = token ? { Authorization: `Bearer ${token}` } : {};
  // Nobody vouches for the certificate of the test.
  const socket = new WebSocket(query ? `${at}/?token=${query}` : at, { headers, rejectUnauthorized: false });
  socket.on("open", () => end("let in"));
  socket.on("error", (error) => end(error.message));
}

function malformed([count]) {
  const socket = new WebSocket(`ws://127.0.0.1:${at}`);
  let reports = 0;
  socket.on("message", (report) => {
    reports += JSON.parse(report).level === "error" ? 1 : 0;
    if (reports === Number(count)) end({ reports });
  });
  socket.on("open", async () => {
    const wrong = ["{", '{"op":1}', '{"op":"publish","msg":{}}', "\u0000", '{"op":"fragment","num":9}', Buffer.from([255])];
    for (let number = 0; number < Number(count); number += 1) {
      socket.send(wrong[number % wrong.length]);
      if (number % 100 === 0) await pause(1);
    }
  });
}

await { publish, wait, attempt, malformed }[part](rest);
