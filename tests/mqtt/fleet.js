// Vehicles that speak VDA 5050, or their control, at a broker.
//
//     node fleet.js vehicles PORT [COUNT]
//     node fleet.js control  PORT [COUNT]
//
// Vehicles are virtual: they drive as orders say. The control sends each an order over 12 m shortly after it has heard
// all of them, which may take long on a busy machine, and publishes on `fleet/finished` how many seconds each order
// took until it heard of its end.

const { AgvController, MasterController, VirtualAgvAdapter } = require("vda-5050-lib");
const mqtt = require("mqtt");

const [part, port, count = "3"] = process.argv.slice(2);
const url = `mqtt://127.0.0.1:${port}`;
const settings = { interfaceName: "uagv", transport: { brokerUrl: url }, vdaVersion: "2.0.0" };
const vehicles = Array.from({ length: Number(count) }, (_, at) => ({ manufacturer: "acme", serialNumber: `agv${at}` }));

/** Starts the vehicles, each twelve metres per second fast. */
async function drive() {
  for (const [at, vehicle] of vehicles.entries()) {
    const start = { mapId: "hall", x: 0, y: 2 * at, theta: 0, lastNodeId: "start" };
    const adapter = { initialPosition: start, vehicleSpeed: 12, tickRate: 20 };
    const options = { agvAdapterType: VirtualAgvAdapter, publishStateInterval: 500 };
    await new AgvController(vehicle, settings, options, adapter).start();
  }
  console.log("ready");
}

/** An order to drive 12 m. */
function order(at) {
  const node = (nodeId, sequenceId, x) => ({
    nodeId, sequenceId, released: true, actions: [], nodePosition: { x, y: 2 * at, mapId: "hall" },
  });
  const edge = {
    edgeId: "way", sequenceId: 1, startNodeId: "start", endNodeId: "end", released: true, actions: [],
  };
  return {
    orderId: `order${at}`, orderUpdateId: 0, nodes: [node("start", 0, 0), node("end", 2, 12)], edges: [edge],
  };
}

/** Sends the orders. */
async function control() {
  const client = await mqtt.connectAsync?.(url) ?? mqtt.connect(url);
  const master = new MasterController(settings, {});
  await master.start();
  const silent = new Set(vehicles.map(({ serialNumber }) => serialNumber));
  const heard = new Promise((resolve) => client.on("message", (topic) => {
    silent.delete(topic.split("/")[3]);
    if (silent.size === 0) resolve();
  }));
  await new Promise((resolve, reject) => {
    client.subscribe("uagv/v2/acme/+/state", (error) => error ? reject(error) : resolve());
  });
  console.log("ready");
  await heard;
  await new Promise((resolve) => setTimeout(resolve, 1500));
  for (const [at, vehicle] of vehicles.entries()) {
    const begin = process.hrtime.bigint();
    const done = (error, canceled, active) => {
      if (error) console.error(error);
      if (error || canceled || active) return;
      const seconds = Number(process.hrtime.bigint() - begin) / 1e9;
      client.publish("fleet/finished", JSON.stringify({ order: at, seconds }), { qos: 1 });
    };
    master.assignOrder(vehicle, order(at), { onOrderProcessed: done }).catch((error) => console.error(error));
  }
}

({ vehicles: drive, control })[part]().catch((error) => {
  console.error(error);
  process.exit(1);
});
