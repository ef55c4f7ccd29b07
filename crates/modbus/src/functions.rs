//! Carries out requests by function. The answer takes the place of the request in the frame.
//!
//! Source: MODBUS Application Protocol V1.1b3, sections 6.3, 6.4, 6.6, 6.8, 6.12, 6.21. A request that is not as long as
//! it says is a fault of its values (section 7, code 03).

use crate::diagnostics::{self, Counters};
use crate::exception::Exception;
use crate::frame::Frame;
use crate::host::{Host, Write};
use crate::identification::Identification;
use crate::request::{self, function};
use crate::settings::Settings;
use crate::write;

/// Most registers of one reading request.
const MOST_READ: u16 = 125;
/// Most tries of a reading whose state changes meanwhile.
const MOST_LOOKS: usize = 8;
/// Most registers of one writing request.
const MOST_WRITTEN: u16 = 123;

/// Address and function; the same, address and quantity of registers.
const HEAD: usize = 2;
const WRITE_HEAD: usize = 6;

/// The part of the server that the functions use.
#[derive(Debug)]
pub struct Inner {
    pub settings: Settings,
    pub identification: &'static Identification,
    pub counters: Counters,
    /// The port is to run like this as soon as the answer is out.
    pub next: Option<Settings>,
}

/// Carries out a request that arrived without a fault. Of broadcasts, only writes are carried out.
#[inline(never)]
pub fn execute<H: Host>(
    inner: &mut Inner,
    frame: &mut Frame,
    broadcast: bool,
    host: &mut H,
) -> Result<(), Exception> {
    let &[_, code, ref data @ ..] = frame.bytes() else { return Err(Exception::IllegalFunction) };
    match code {
        // The function is not an allowable action, or the server is in the wrong state for it (section 7, code 01).
        _ if inner.settings.locked && request::changes(frame.bytes()) => Err(Exception::IllegalFunction),
        function::WRITE_ONE => {
            let &[high, low, ref word @ ..] = data else { return Err(Exception::IllegalDataValue) };
            let (words @ [_], []) = word.as_chunks() else { return Err(Exception::IllegalDataValue) };
            // The answer is the request.
            set(inner, u16::from_be_bytes([high, low]), words, host)
        }
        function::WRITE_MANY => {
            let &[high, low, quantity_high, quantity_low, bytes, ref words @ ..] = data else {
                return Err(Exception::IllegalDataValue);
            };
            let quantity = u16::from_be_bytes([quantity_high, quantity_low]);
            let (words, rest) = words.as_chunks();
            let lengths = [usize::from(bytes) / 2, words.len()];
            if !(1..=MOST_WRITTEN).contains(&quantity)
                || lengths != [usize::from(quantity); 2]
                || bytes & 1 != 0
                || !rest.is_empty()
            {
                return Err(Exception::IllegalDataValue);
            }
            set(inner, u16::from_be_bytes([high, low]), words, host)?;
            frame.truncate(WRITE_HEAD);
            Ok(())
        }
        // A broadcast has no answer: only writes have an effect.
        _ if broadcast => Ok(()),
        function::READ_HOLDING | function::READ_INPUT => {
            let &[high, low, quantity_high, quantity_low] = data else {
                return Err(Exception::IllegalDataValue);
            };
            let first = u16::from_be_bytes([high, low]);
            read(inner, first, u16::from_be_bytes([quantity_high, quantity_low]), frame, host)
        }
        function::DIAGNOSTICS => {
            let register = || {
                host.begin();
                host.status()
            };
            diagnostics::answer(&mut inner.counters, register, frame)
        }
        function::IDENTIFICATION => inner.identification.answer(frame),
        _ => Err(Exception::IllegalFunction),
    }
}

/// Reads registers, all of one state. A function of its own: a write does not pay for its stack.
#[inline(never)]
fn read<H: Host>(
    inner: &Inner,
    first: u16,
    quantity: u16,
    frame: &mut Frame,
    host: &mut H,
) -> Result<(), Exception> {
    if !(1..=MOST_READ).contains(&quantity) {
        return Err(Exception::IllegalDataValue);
    }
    for _ in 0..MOST_LOOKS {
        host.begin();
        frame.truncate(HEAD);
        frame.byte(quantity.wrapping_mul(2) as u8);
        host.read(&inner.settings, first, quantity, &mut |word| frame.word(word))?;
        if host.held_still() {
            return Ok(());
        }
    }
    Err(Exception::ServerDeviceBusy)
}

#[inline(never)]
fn set<H: Host>(inner: &mut Inner, first: u16, words: &[[u8; 2]], host: &mut H) -> Result<(), Exception> {
    host.begin();
    let change = write::change(&inner.settings, first, words)?;
    host.write(&change)?;
    if let Write::Port(settings) = change {
        inner.next = Some(settings);
    }
    Ok(())
}
