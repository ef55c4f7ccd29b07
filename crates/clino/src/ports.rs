//! `clino ports`: the serial ports of this computer.

use clap::Args;

use crate::outcome::{DecodeVerdict, Failure};
use crate::port::{self, Listed};
use crate::say::{Item, Say};

/// `clino ports`
#[derive(Args)]
pub struct Arguments {
    /// One JSON object per line
    #[arg(long)]
    json: bool,
}

/// Lists them; what keeps one from being used follows it.
pub fn run(arguments: &Arguments) -> Result<DecodeVerdict, Failure> {
    let mut say = Say::new(arguments.json);
    let ports = port::list()?;
    for Listed { port, usb, stable_name, latency_ms, problem } in &ports {
        let word = |word: Option<&str>| word.map_or(Item::None, |word| Item::Text(word.to_owned()));
        let usb = usb.as_ref();
        let mut values = vec![
            ("name", word(Some(port))),
            ("usb", word(usb.map(|usb| usb.id.as_str()))),
            ("adapter", word(usb.map(|usb| usb.name.as_str()))),
            ("serial", word(usb.and_then(|usb| usb.serial.as_deref()))),
            ("stable_name", word(stable_name.as_deref())),
            ("latency_ms", latency_ms.map_or(Item::None, Item::from)),
        ];
        if say.is_for_programs() {
            values.push(("problem", word(problem.as_ref().map(port::PortError::kind))));
        } else {
            // A person does not need the names of missing values.
            values.retain(|(_, value)| *value != Item::None);
        }
        say.line("port", &values)?;
        if let Some(problem) = problem.as_ref().filter(|_| !say.is_for_programs()) {
            say.error(&problem.message(), &problem.next())?;
        }
    }
    if ports.is_empty() {
        say.hint("none", "no serial port: plug the adapter in, and look again")?;
    }
    Ok(DecodeVerdict::Good)
}
