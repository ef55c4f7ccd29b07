//! The table.

use clino_codec::angle::{Angle, AngleText, Range};
use clino_codec::ascii::{Centidegrees, LineDecoder};
use clino_codec::checks::{CheckCounters, Checks};
use clino_codec::isu::eeprom::{self, Audit, Image, Plan, PlannedWrite};
use clino_codec::pwm::{self, Law, Limits, Ticks};
use clino_codec::{isu, t7};

/// Address of a function.
pub struct Entry(#[expect(dead_code, reason = "never called")] *const ());

// SAFETY: never called or dereferenced.
unsafe impl Sync for Entry {}

macro_rules! entries {
    ($($function:expr),* $(,)?) => {
        [$(Entry($function as *const ())),*]
    };
}

pub static ENTRIES: &[Entry] = &entries![
    Angle::from_mdeg,
    Angle::from_centideg,
    Angle::from_turn16,
    Angle::mdeg,
    Angle::to_turn16,
    Angle::normalised,
    Angle::difference,
    Angle::text,
    AngleText::as_str,
    Range::contains,
    t7::Address::new,
    t7::Address::of_request,
    t7::Request::encode,
    t7::Request::decode,
    t7::Request::expected,
    t7::Expected::check,
    t7::Answer::decode,
    t7::Answer::decode_with,
    t7::Answer::encode,
    t7::Response::encode,
    t7::Response::status,
    t7::Text::trimmed,
    t7::Text::as_str,
    t7::DeviceInformation::is_single_axis,
    t7::DeviceInformation::has_axis,
    t7::Acceleration::micro_g,
    t7::Temperature::is_documented,
    t7::Millidegrees::angle,
    t7::BaudRate::from_bits_per_second,
    t7::BaudRate::bits_per_second,
    t7::Opcode::new,
    t7::CommandFrame::as_bytes,
    t7::AnswerFrame::as_bytes,
    t7::AnswerDecoder::<Checks>::new,
    t7::AnswerDecoder::<Checks>::restart,
    t7::AnswerDecoder::<Checks>::push,
    t7::AnswerDecoder::<Checks>::idle,
    t7::Sniffer::new,
    t7::Sniffer::push,
    t7::Sniffer::idle,
    isu::Address::new,
    isu::Request::encode,
    isu::Request::encode_even_if_it_bricks_the_module,
    isu::Request::decode,
    isu::Request::expected,
    isu::Expected::check,
    isu::Answer::decode,
    isu::Answer::decode_with,
    isu::Answer::angle,
    isu::Response::encode,
    isu::Data::new,
    isu::Words::new,
    isu::Frame::as_bytes,
    isu::AnswerDecoder::<Checks>::new,
    isu::AnswerDecoder::<Checks>::restart,
    isu::AnswerDecoder::<Checks>::push,
    isu::AnswerDecoder::<Checks>::idle,
    eeprom::pack,
    eeprom::unpack,
    Image::word,
    Image::data,
    Image::module_address,
    Image::null_position,
    Image::audit,
    Audit::is_sound,
    Audit::only_reading,
    Plan::change,
    Plan::repair,
    Plan::apply,
    Plan::writes,
    PlannedWrite::words,
    PlannedWrite::before,
    PlannedWrite::request,
    PlannedWrite::read_back,
    LineDecoder::push,
    Centidegrees::encode,
    pwm::measure,
    Law::angle,
    Ticks::duty_ppm,
    Limits::new,
    CheckCounters::accept,
    CheckCounters::refuse,
    CheckCounters::refused,
    iterators,
];

/// Functions that exist only where they are used: iterators and their like.
fn iterators(words: &isu::Words, image: &mut Image) -> usize {
    image.fill(0, words.iter());
    #[cfg(feature = "planted")]
    core::hint::black_box(words.as_be_bytes()[0]);
    t7::Address::sweep().count() + isu::Address::sweep().count()
}
