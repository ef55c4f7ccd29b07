//! Whatever the order of events: the driver does not stay on, no node is interrupted, no foreign character is lost.

use super::*;
use proptest::prelude::*;

#[derive(Clone, Debug)]
enum Action {
    Submit(usize),
    Wait(u64),
    TransmitEmpty,
    TransmitComplete,
    /// Any character, at any time.
    Stranger(u8),
    /// A character as it was sent.
    Echo,
    Set(u32),
}

fn action() -> impl Strategy<Value = Action> {
    prop_oneof![
        3 => (0usize..45).prop_map(Action::Submit),
        4 => (0u64..500).prop_map(Action::Wait),
        6 => Just(Action::TransmitEmpty),
        2 => Just(Action::TransmitComplete),
        2 => any::<u8>().prop_map(Action::Stranger),
        3 => Just(Action::Echo),
        1 => prop_oneof![Just(9_600), Just(115_200)].prop_map(Action::Set),
    ]
}

fn settings() -> impl Strategy<Value = LineSettings> {
    let echo = prop_oneof![Just(EchoMode::Off), Just(EchoMode::Expected), Just(EchoMode::Detect)];
    (0u64..200, prop_oneof![Just(0), 0u64..300], prop_oneof![Just(0), 0u64..300], echo).prop_map(
        |(guard, pre, post, echo)| LineSettings {
            serial: SERIAL,
            guard: Duration::from_micros(guard as u32),
            pre_delay: Duration::from_micros(pre as u32),
            post_delay: Duration::from_micros(post as u32),
            echo,
        },
    )
}

/// What the test knows about the line without asking it.
#[derive(Default)]
struct Watch {
    raised: Option<u64>,
    /// Earliest end of the guard.
    guarded: Option<f64>,
    /// Characters of the frame that were handed out, and came back.
    handed_out: StdVec<u8>,
    came_back: usize,
    complete: Option<u64>,
}

fn bit(baud: u32) -> f64 {
    1e6 / f64::from(baud)
}

proptest! {
    #![proptest_config(ProptestConfig::with_cases(2_000))]

    #[test]
    fn no_interleaving_breaks_the_line(settings in settings(), actions in prop::collection::vec(action(), 1..200)) {
        let mut line = line_with(settings);
        let mut settings = settings;
        let mut now = 0;
        let mut watch = Watch::default();
        for action in actions {
            match action {
                Action::Submit(length) => {
                    let frame: StdVec<u8> = (0..length as u8).collect();
                    _ = line.submit(&frame, Instant::from_micros(now + 600));
                }
                Action::Wait(span) => now += span,
                Action::TransmitEmpty => {
                    let was_driving = line.driving();
                    if let Some(byte) = line.next_character() {
                        prop_assert!(was_driving, "a character for a driver that is off");
                        watch.handed_out.push(byte);
                    }
                }
                Action::TransmitComplete => {
                    let was_driving = line.driving();
                    if line.transmission_complete(Instant::from_micros(now)) {
                        prop_assert!(was_driving);
                        prop_assert_eq!(line.driving(), settings.post_delay.as_micros() > 0);
                        watch.complete = Some(now);
                    }
                }
                Action::Stranger(_) | Action::Echo => {
                    let byte = match action {
                        Action::Stranger(byte) => byte,
                        _ => watch.handed_out.get(watch.came_back).copied().unwrap_or(0xEE),
                    };
                    let in_post_delay = watch.complete.is_some() && line.driving();
                    let event = line.heard(Character::clean(byte), Instant::from_micros(now));
                    let end = now as f64 + 0.5 * bit(settings.serial.baud);
                    watch.guarded = Some(end + settings.guard.as_micros() as f64);
                    match event {
                        Event::Heard { character, .. } => {
                            prop_assert_eq!(character.byte, byte);
                            prop_assert!(!(in_post_delay && line.driving()), "the driver fights an answer");
                        }
                        Event::Echo { .. } | Event::Contention { .. } => {
                            prop_assert_ne!(settings.echo, EchoMode::Off);
                            // At most as many as were sent, and none that an answering node could have sent: its first
                            // character takes 9.5 bits from our last stop bit.
                            prop_assert!(watch.came_back < watch.handed_out.len());
                            if let Some(complete) = watch.complete {
                                prop_assert!(((now - complete) as f64) < 9.5 * bit(settings.serial.baud));
                            }
                            if let Event::Echo { .. } = event {
                                prop_assert_eq!(byte, watch.handed_out[watch.came_back]);
                            } else {
                                prop_assert_ne!(byte, watch.handed_out[watch.came_back]);
                            }
                            watch.came_back += 1;
                        }
                        other => prop_assert!(false, "{:?}", other),
                    }
                }
                Action::Set(baud) => {
                    let new = LineSettings { serial: Serial { baud }, ..settings };
                    let was_driving = line.driving();
                    if line.set(new, Instant::from_micros(now)).is_ok() {
                        prop_assert!(!was_driving);
                        settings = new;
                    }
                }
            }
            let was_driving = line.driving();
            while let Some(step) = line.poll(Instant::from_micros(now)) {
                match step {
                    LineStep::Begin => prop_assert!(line.driving()),
                    LineStep::Force | LineStep::GiveUp => prop_assert!(!line.driving()),
                    LineStep::EchoLost => prop_assert_ne!(settings.echo, EchoMode::Off),
                }
            }
            if line.driving() && !was_driving {
                prop_assert!(watch.guarded.is_none_or(|guarded| now as f64 >= guarded));
                watch = Watch { raised: Some(now), guarded: watch.guarded, ..Watch::default() };
            }
            if !line.driving() {
                watch.raised = None;
            }
            if let Some(raised) = watch.raised {
                let characters = line.frame_len() as f64 * 10.0 * bit(settings.serial.baud);
                let spare = (characters / 4.0).max(10.0 * bit(settings.serial.baud));
                let delays = (settings.pre_delay + settings.post_delay).as_micros() as f64;
                // Rounded up to microseconds in three places.
                prop_assert!(((now - raised) as f64) < characters + spare + delays + 3.0);
                prop_assert!(line.poll_at().is_some(), "a driver that is on has a deadline");
            }
        }
    }
}
