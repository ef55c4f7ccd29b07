//! A T7 at a serial port of a PC, through an adapter that switches its driver by itself: prints the angle of axis 2.
//!
//! `linux-serial /dev/ttyUSB0 127`

use std::io::{self, ErrorKind};
use std::ops::ControlFlow;
use std::time::{Duration as Time, Instant};

use clino_drivers::codec::{
    character::Character,
    t7::{Address, Axis},
};
use clino_drivers::{Duration, Port, Serial, Timing, UsDigitalT7};
use serial2::SerialPort;

struct Adapter(SerialPort);

impl Port for Adapter {
    type Error = io::Error;

    fn send(&mut self, frame: &[u8]) -> io::Result<()> {
        self.0.write_all(frame)?;
        self.0.flush()
    }

    fn listen(
        &mut self,
        span: Duration,
        mut take: impl FnMut(Character, Duration) -> ControlFlow<()>,
    ) -> ControlFlow<()> {
        let begun = Instant::now();
        let passed = || Duration::from_micros(begun.elapsed().as_micros() as u32);
        let mut bytes = [0; 64];
        loop {
            // Waits for a millisecond at most.
            match self.0.read(&mut bytes) {
                Ok(n) => bytes[..n].iter().try_for_each(|&byte| take(Character::clean(byte), passed()))?,
                Err(error) if error.kind() == ErrorKind::TimedOut => {}
                Err(_) => std::thread::sleep(Time::from_millis(1)),
            }
            if passed() >= span {
                return ControlFlow::Continue(());
            }
        }
    }
}

fn main() -> Result<(), Box<dyn std::error::Error>> {
    let arguments: Vec<String> = std::env::args().collect();
    let [_, path, number] = &arguments[..] else { return Err("PORT ADDRESS".into()) };
    let address = Address::new(number.parse()?).ok_or("an address is 1 to 100, or 127")?;
    let serial = Serial::T7_DEFAULT;
    let mut port = SerialPort::open(path, serial.baud)?;
    port.set_read_timeout(Time::from_millis(1))?;
    // Most USB adapters hand over what they have every 16 ms at the latest.
    let timing = Timing::t7(serial).handed_over_within(Duration::from_millis(16));
    println!("{}°", UsDigitalT7::new(Adapter(port), timing).angle(address, Axis::Two)?);
    Ok(())
}
