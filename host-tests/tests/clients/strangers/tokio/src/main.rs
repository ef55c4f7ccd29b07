//! Reads a gateway with tokio-modbus, and sets up a slot. Arguments and output: `strangers.rs`.

use std::error::Error;
use std::future::Future;
use std::time::Duration;

use tokio_modbus::client::Context;
use tokio_modbus::prelude::*;

const SLOTS: u16 = 6;

type Failure = Box<dyn Error>;

/// This client has no timeout of its own.
async fn answer<T>(request: impl Future<Output = tokio_modbus::Result<T>>) -> Result<T, Failure> {
    Ok(tokio::time::timeout(Duration::from_secs(60), request).await???)
}

async fn words(master: &mut Context, address: u16, count: u16) -> Result<Vec<u16>, Failure> {
    answer(master.read_holding_registers(address, count)).await
}

fn long(words: &[u16]) -> u32 {
    u32::from(words[0]) << 16 | u32::from(words[1])
}

fn print<T: ToString>(name: &str, values: impl Iterator<Item = T>) {
    let values: Vec<String> = values.map(|value| value.to_string()).collect();
    println!("{name} {}", values.join(" "));
}

#[tokio::main(flavor = "current_thread")]
async fn main() -> Result<(), Failure> {
    let arguments: Vec<String> = std::env::args().collect();
    let numbers: Vec<u16> = arguments[2..].iter().map(|number| number.parse()).collect::<Result<_, _>>()?;
    let [angles, ages, floats, cdab, counter, settings, spare] = numbers[..] else { return Err("seven numbers".into()) };
    let port = tokio_serial::SerialStream::open(&tokio_serial::new(&arguments[1], 19_200))?;
    let mut master = rtu::attach_slave(port, Slave(1));
    let master = &mut master;

    let mut shown = vec![i32::MIN];
    for _ in 0..300 {
        if !shown.contains(&i32::MIN) {
            break;
        }
        shown = words(master, angles, 2 * SLOTS).await?.chunks(2).map(|pair| long(pair) as i32).collect();
    }
    print("angles", shown.into_iter());
    print("ages", answer(master.read_input_registers(ages, SLOTS)).await?.into_iter());
    let float = |pair: &[u16]| f32::from_bits(long(pair));
    print("floats", words(master, floats, 2 * SLOTS).await?.chunks(2).map(float));
    let swapped = |pair: &[u16]| f32::from_bits(long(&[pair[1], pair[0]]));
    print("cdab", words(master, cdab, 2 * SLOTS).await?.chunks(2).map(swapped));
    print("counter", [long(&words(master, counter, 2).await?)].into_iter());
    let identity = answer(master.read_device_identification(ReadCode::Regular, 0)).await?;
    for object in identity.device_id_objects {
        println!("object {} {}", object.id, String::from_utf8_lossy(&object.value));
    }
    answer(master.write_multiple_registers(settings, &[1, 1, spare])).await?;
    let mut shown = i32::MIN;
    for _ in 0..300 {
        shown = long(&words(master, angles + 2 * SLOTS, 2).await?) as i32;
        if shown != i32::MIN {
            break;
        }
    }
    println!("set_up {shown}");
    answer(master.write_single_register(settings, 0)).await?;
    Ok(())
}
