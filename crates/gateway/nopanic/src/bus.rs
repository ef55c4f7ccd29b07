//! clino-bus, with a master for each of its protocols.

use clino_bus::line::{LineSettings, SubmitError};
use clino_bus::{
    Blame, BusCounters, Duration, Fault, Instant, Isu, Line, Master, Protocol, Retry, Serial, T7, Timing, earliest,
};

use crate::{Entry, entries};

pub static ENTRIES: &[Entry] = &entries![
    Line::new,
    Line::set,
    Line::settings,
    Line::has_echo,
    Line::submit,
    Line::poll,
    Line::poll_at,
    Line::next_character,
    Line::transmission_complete,
    Line::heard,
    Line::driving,
    Line::frame_len,
    Line::longest_hold,
    LineSettings::new,
    SubmitError::blame,
    BusCounters::default,
    Instant::from_micros,
    Instant::from_millis,
    Instant::as_micros,
    Instant::since,
    Instant::micros_since,
    Instant::millis_since,
    <Instant as core::ops::Add<Duration>>::add,
    <Instant as core::ops::Sub<Duration>>::sub,
    Duration::from_micros,
    Duration::from_millis,
    Duration::as_micros,
    Duration::as_millis,
    Duration::times,
    Duration::plus,
    Duration::longer,
    <Duration as core::ops::Add>::add,
    <Duration as core::ops::Sub>::sub,
    earliest,
    Serial::bits,
    Serial::half_bit,
    Serial::characters,
    Timing::t7,
    Timing::isu,
    Timing::line,
    Timing::first_character,
    Retry::times,
];

macro_rules! of_protocol {
    ($protocol:ty) => {
        &entries![
            Master::<$protocol>::new,
            Master::<$protocol>::take_late,
            Master::<$protocol>::is_idle,
            Master::<$protocol>::is_asking,
            Master::<$protocol>::counters,
            Master::<$protocol>::clear_counters,
            Master::<$protocol>::timing,
            Master::<$protocol>::set_timing,
            Master::<$protocol>::on,
            Master::<$protocol>::poll,
            Master::<$protocol>::poll_at,
            Master::<$protocol>::ask_at,
            Master::<$protocol>::may_ask,
            Master::<$protocol>::begin,
            Master::<$protocol>::begin_retry,
            Master::<$protocol>::begin_collecting,
            Master::<$protocol>::allow,
            Retry::after::<<$protocol as Protocol>::DecodeError>,
            Fault::<<$protocol as Protocol>::DecodeError>::by_check,
            blame::<$protocol>,
        ]
    };
}

pub static T7_ENTRIES: &[Entry] = of_protocol!(T7);
pub static ISU_ENTRIES: &[Entry] = of_protocol!(Isu);

fn blame<P: Protocol>(fault: &Fault<P::DecodeError>) -> (Blame, bool) {
    (fault.blame(), fault.request_unheard())
}
