// Reads a gateway with npm's jsmodbus, and sets up a slot. Arguments and output: strangers.rs.
//
// It has no functions 08 and 43.
"use strict";
const { SerialPort } = require("serialport");
const modbus = require("jsmodbus");

const SLOTS = 6;
const NONE = -0x80000000;
const [port, ...numbers] = process.argv.slice(2);
const [angles, ages, floats, cdab, counter, settings, spare] = numbers.map(Number);
const each = (of) => Array.from({ length: SLOTS }, (_, slot) => of(slot));

const line = new SerialPort({ path: port, baudRate: 19200 });
const master = new modbus.client.RTU(line, 1, 60000);

async function read(address, count) {
  return (await master.readHoldingRegisters(address, count)).response.body.valuesAsBuffer;
}

async function main() {
  let block, shown;
  for (let tries = 0; tries < 300 && !(shown && !shown.includes(NONE)); tries++) {
    block = await read(angles, 2 * SLOTS);
    shown = each((slot) => block.readInt32BE(4 * slot));
  }
  console.log("angles", ...shown);
  const input = await master.readInputRegisters(ages, SLOTS);
  console.log("ages", ...input.response.body.valuesAsArray);
  block = await read(floats, 2 * SLOTS);
  console.log("floats", ...each((slot) => block.readFloatBE(4 * slot)));
  // CD AB: the bytes of each register, then all four, the other way round.
  block = Buffer.from(await read(cdab, 2 * SLOTS)).swap16().swap32();
  console.log("cdab", ...each((slot) => block.readFloatBE(4 * slot)));
  console.log("counter", (await read(counter, 2)).readUInt32BE(0));
  await master.writeMultipleRegisters(settings, [1, 1, spare]);
  shown = NONE;
  for (let tries = 0; tries < 300 && shown === NONE; tries++) {
    shown = (await read(angles + 2 * SLOTS, 2)).readInt32BE(0);
  }
  console.log("set_up", shown);
  await master.writeSingleRegister(settings, 0);
  line.close();
}

line.on("open", () =>
  main().catch((error) => {
    console.error(error);
    process.exit(1);
  })
);
