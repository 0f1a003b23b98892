// A client of a bridge by roslib that publishes numbered messages, or waits for some; or a connection without roslib.
//
//     node client.mjs publish PORT TOPIC COUNT RATE
//     node client.mjs wait    PORT TOPIC COUNT [COMPRESSION]
//     node client.mjs attempt URL [TOKEN] [QUERY]
//     node client.mjs malformed PORT COUNT
//
// `publish` and `wait` connect as soon as somebody listens; a publisher waits for a line on its standard input. At the
// end they say as JSON how many messages there were, and the digest of what they say. `attempt` says whether it was let
// in, with a token in a header or in the address. `malformed` sends what is no operation, and says how many reports it
// got.

import { createHash } from "node:crypto";
import { Ros, Topic } from "roslib";
import { WebSocket } from "ws";

const TYPE = "sensor_msgs/JointState";
const [part, at, ...rest] = process.argv.slice(2);
const digest = createHash("sha256");
const pause = (milliseconds) => new Promise((resolve) => setTimeout(resolve, milliseconds));

function end(said) {
  console.log(JSON.stringify(said));
  process.exit(0);
}

// What a message says, the same in every language.
function said(content) {
  return `${content.name[0]}:${Array.from(content.position, (position) => Math.round(position * 8)).join(",")};`;
}

async function connected() {
  const ros = new Ros();
  for (let tries = 0; tries < 300; tries += 1) {
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

async function publish([name, count, rate]) {
  const topic = new Topic({ ros: await connected(), name, messageType: TYPE, queue_size: 1000 });
  topic.advertise();
  await new Promise((resolve) => process.stdin.once("data", resolve));
  await pause(1000); // nodes behind the bridge may take a moment to find each other
  const begin = Date.now();
  for (let number = 0; number < Number(count); number += 1) {
    const content = { name: [`j${number}`], position: [number / 8, -number / 4], velocity: [], effort: [] };
    digest.update(said(content));
    topic.publish(content);
    const due = begin + ((number + 1) * 1000) / Number(rate);
    if (due > Date.now()) await pause(due - Date.now());
  }
  await pause(1000);
  end({ count: Number(count), digest: digest.digest("hex") });
}

async function wait([name, count, compression = "none"]) {
  const topic = new Topic({ ros: await connected(), name, messageType: TYPE, compression, queue_length: 0 });
  let heard = 0;
  topic.subscribe((content) => {
    digest.update(said(content));
    heard += 1;
    if (heard === Number(count)) end({ count: heard, digest: digest.digest("hex") });
  });
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
