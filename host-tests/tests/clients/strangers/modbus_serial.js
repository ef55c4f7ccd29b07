// Reads a gateway with npm's modbus-serial, and sets up a slot. Arguments and output: strangers.rs.
//
// It has no function 08.
"use strict";
const ModbusRTU = require("modbus-serial");

const SLOTS = 6;
const NONE = -0x80000000;
const [port, ...numbers] = process.argv.slice(2);
const [angles, ages, floats, cdab, counter, settings, spare] = numbers.map(Number);
const each = (of) => Array.from({ length: SLOTS }, (_, slot) => of(slot));

async function main() {
  const master = new ModbusRTU();
  await master.connectRTUBuffered(port, { baudRate: 19200 });
  master.setID(1);
  master.setTimeout(60000);
  const read = async (address, count) => (await master.readHoldingRegisters(address, count)).buffer;

  let block, shown;
  for (let tries = 0; tries < 300 && !(shown && !shown.includes(NONE)); tries++) {
    block = await read(angles, 2 * SLOTS);
    shown = each((slot) => block.readInt32BE(4 * slot));
  }
  console.log("angles", ...shown);
  const { data } = await master.readInputRegisters(ages, SLOTS);
  console.log("ages", ...data);
  block = await read(floats, 2 * SLOTS);
  console.log("floats", ...each((slot) => block.readFloatBE(4 * slot)));
  // CD AB: the bytes of each register, then all four, the other way round.
  block = Buffer.from(await read(cdab, 2 * SLOTS)).swap16().swap32();
  console.log("cdab", ...each((slot) => block.readFloatBE(4 * slot)));
  console.log("counter", (await read(counter, 2)).readUInt32BE(0));
  // All of them, and each alone: this hung on an object without a text, for the rest of the session.
  const all = await master.readDeviceIdentification(2, 0);
  for (const [object, text] of Object.entries(all.data)) console.log("object", object, text);
  for (const object of Object.keys(all.data)) {
    const one = await master.readDeviceIdentification(4, Number(object));
    if (one.data[object] !== all.data[object]) throw new Error(`object ${object}`);
  }
  // It goes on.
  if ((await read(angles, 2)).length !== 4) throw new Error("no reading after the identification");

  await master.writeRegisters(settings, [1, 1, spare]);
  shown = NONE;
  for (let tries = 0; tries < 300 && shown === NONE; tries++) {
    shown = (await read(angles + 2 * SLOTS, 2)).readInt32BE(0);
  }
  console.log("set_up", shown);
  await master.writeRegister(settings, 0);
  await new Promise((done) => master.close(done));
}

main().catch((error) => {
  console.error(error);
  process.exit(1);
});
