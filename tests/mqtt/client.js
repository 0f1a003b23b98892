// A client of MQTT that publishes numbered messages, or waits for some.
//
//     node client.js publish PORT TOPIC COUNT RATE QUALITY [retain] [malformed]
//     node client.js wait    PORT TOPIC COUNT QUALITY
//
// It says `ready`, and a publisher then waits for a line on its standard input. At its end it says as JSON how many
// messages there were, the digest of their payloads, and of the one that waits, how many were retained. Payloads have
// fields and spaces that no space declares.

const { createHash } = require("crypto");
const mqtt = require("mqtt");

const [part, port, topic, count, ...rest] = process.argv.slice(2);
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
      if (heard === Number(count)) setTimeout(() => end({ heard, retained }), 300);
    });
    client.subscribe(topic, { qos: Number(rest[0]) }, () => console.log("ready"));
    return;
  }
  const [rate, qos] = rest.map(Number);
  console.log("ready");
  process.stdin.once("data", () => {
    let sent = 0, done = 0;
    const begin = Date.now();
    const timer = setInterval(() => {
      while (sent < Number(count) && sent <= ((Date.now() - begin) * rate) / 1000) {
        const text = payload(sent, rest.includes("malformed"));
        digest.update(text);
        sent += 1;
        client.publish(topic, text, { qos, retain: rest.includes("retain") }, () => {
          done += 1;
          if (done === Number(count)) end({ sent });
        });
      }
      if (sent === Number(count)) clearInterval(timer);
    }, 1);
  });
});
