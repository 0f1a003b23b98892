// A client of MQTT that publishes numbered messages, or waits for some.
//
//     node client.js publish PORT TOPIC COUNT BATCH QUALITY [retain] [malformed] [slowly]
//     node client.js wait    PORT TOPIC COUNT BATCH QUALITY
//
// It says `ready`. For each line on its standard input a publisher then sends a batch, at once or slowly, which are 100
// messages per second; who waits says `count` after each batch. At its end it says as JSON how many messages there
// were, the digest of their payloads, and of the one that waits, how many were retained. Payloads have fields and
// spaces that no space declares.

const { createHash } = require("crypto");
const { createInterface } = require("readline");
const mqtt = require("mqtt");

const [part, port, topic, count, batch, quality, ...rest] = process.argv.slice(2);
const qos = Number(quality);
const client = mqtt.connect(`mqtt://127.0.0.1:${port}`, { reconnectPeriod: 50 });
const digest = createHash("sha256");

function end(said) {
  console.log(JSON.stringify({ ...said, digest: digest.digest("hex") }));
  client.end(false, () => process.exit(0));
}

function payload(number, malformed) {
  return malformed ? `{"speed": ${number}` : `{ "id": "m${number}",  "speed": ${number}.250, "more": [1, {}] }`;
}

client.once("connect", () => {
  if (part === "wait") {
    let heard = 0, retained = 0;
    client.on("message", (_, bytes, packet) => {
      digest.update(bytes);
      heard += 1;
      retained += packet.retain ? 1 : 0;
      if (heard % Number(batch) === 0) console.log(JSON.stringify({ count: heard }));
      // What is too much would come now.
      if (heard === Number(count)) setTimeout(() => end({ heard, retained }), 300);
    });
    client.subscribe(topic, { qos }, () => console.log("ready"));
    return;
  }
  console.log("ready");
  let sent = 0, done = 0, permitted = 0;
  const publish = () => {
    const text = payload(sent, rest.includes("malformed"));
    digest.update(text);
    sent += 1;
    client.publish(topic, text, { qos, retain: rest.includes("retain") }, () => {
      done += 1;
      if (done === Number(count)) end({ sent });
    });
  };
  const isPermitted = () => sent < Math.min(permitted, Number(count));
  if (rest.includes("slowly")) setInterval(() => isPermitted() && publish(), 10);
  createInterface({ input: process.stdin }).on("line", () => {
    permitted += Number(batch);
    while (!rest.includes("slowly") && isPermitted()) publish();
  });
});
