//! Killed in the middle of a change of address: the sensor is at its old address or its new one, or can be brought there.

use std::process::{Child, Command, Stdio};
use std::sync::{Arc, Mutex};
use std::thread;

use super::adapter::{Adapter, Faults};
use super::common::CLINO;
use super::server::Server;
use super::{clino, frames, json, patiently, what};

/// How often the tool is killed, all commands together, unless `CLINO_PC_KILLS` is `all`: then at every frame, and in each.
const KILLS: usize = 50;
/// Those that go on at the same time: they wait most of their time.
const SIDE_BY_SIDE: usize = 10;

/// At which frame it is killed, and whether that gets out whole.
type Kill = (usize, bool);

/// All that can be: at each frame, whole and in half.
fn all(frames: usize) -> Vec<Kill> {
    (1..=frames).flat_map(|frame| [(frame, true), (frame, false)]).collect()
}

/// As many of them as are wanted, from the first to the last.
fn some(all: Vec<Kill>, wanted: usize) -> Vec<Kill> {
    if wanted >= all.len() || std::env::var_os("CLINO_PC_KILLS").is_some_and(|kills| kills == "all") {
        return all;
    }
    (0..wanted).map(|kill| all[kill * (all.len() - 1) / (wanted - 1)]).collect()
}

/// Kills at each, several side by side.
fn each(kills: &[Kill], kill_at: impl Fn(Kill) + Sync) {
    for kills in kills.chunks(SIDE_BY_SIDE) {
        thread::scope(|scope| {
            for &kill in kills {
                let kill_at = &kill_at;
                scope.spawn(move || kill_at(kill));
            }
        });
    }
}

/// A command that is killed when it has sent this frame, or half of it.
fn killed_at((frame, is_whole): Kill, sensors: &str, baud: u32, line: &str) {
    let child: Arc<Mutex<Option<Child>>> = Arc::new(Mutex::new(None));
    let victim = Arc::clone(&child);
    let on_frame = move |number: usize, bytes: &[u8]| {
        if number != frame {
            return bytes.len();
        }
        victim.lock().unwrap().as_mut().expect("it runs").kill().unwrap();
        if is_whole { bytes.len() } else { bytes.len() / 2 }
    };
    let adapter =
        Adapter::new(sensors, baud, Faults { on_frame: Some(Box::new(on_frame)), ..Faults::default() });
    {
        // The adapter waits with the frame until the child is known.
        let mut child = child.lock().unwrap();
        let line = format!("{line} --yes --json --latency 80 --port {}", adapter.path());
        let spawned = Command::new(CLINO)
            .args(line.split_whitespace())
            .stdin(Stdio::null())
            .stdout(Stdio::null())
            .stderr(Stdio::null())
            .spawn();
        *child = Some(spawned.unwrap());
    }
    loop {
        if child.lock().unwrap().as_mut().expect("it runs").try_wait().unwrap().is_some() {
            break;
        }
        thread::sleep(std::time::Duration::from_millis(5));
    }
}

#[test]
fn a_t7_is_found_and_brought_home() {
    const SENSORS: &str = "--t7 5,serial=25033 --pty";
    let frames = frames(SENSORS, 115_200, "t7 address 5 9 --yes");
    assert!(frames >= 6, "{frames}: a name, three looks, a write, a look");
    each(&some(all(frames), KILLS / 2), |kill| t7_killed_at(kill, SENSORS));
}

fn t7_killed_at(kill: Kill, sensors: &str) {
    let frame = kill.0;
    let server = Server::start(sensors);
    let port = server.path();
    killed_at(kill, &port, 115_200, "t7 address 5 9");
    let address = patiently(|| {
        let objects = clino(&format!("t7 scan --json --port {port} --latency 30")).objects();
        let found: Vec<_> = objects.iter().filter(|object| object["what"] == "found").collect();
        match found[..] {
            [one] if one["serial"] == 25_033 => Ok(one["address"].as_u64().unwrap()),
            _ => Err(format!("killed at {frame}: {objects:?}")),
        }
    });
    assert!([5, 9].contains(&address), "killed at {frame}: at {address}");
    patiently(|| match json(&port, &format!("t7 address {address} 9 --yes")) {
        (0, _) => Ok(()),
        (status, objects) => Err(format!("killed at {frame}: {status} {objects:?}")),
    });
    let (_, objects) = patiently(|| match json(&port, "t7 info 9") {
        (0, objects) => Ok((0, objects)),
        (_, objects) => Err(format!("killed at {frame}: {objects:?}")),
    });
    assert_eq!(what(&objects, "identity")["serial"], 25_033);
}

#[test]
fn an_isu_is_found_and_brought_home_with_a_sound_memory() {
    const SENSORS: &str = "--isu 3,angle=90 --pty";
    let frames = frames(SENSORS, 9_600, "isu address 3 9 --yes");
    assert!(frames >= 10, "{frames}: looks, readings, two writes, a reset");
    each(&some(all(frames), KILLS / 2), |kill| isu_killed_at(kill, SENSORS));
}

fn isu_killed_at(kill: Kill, sensors: &str) {
    let frame = kill.0;
    let server = Server::start(sensors);
    let port = server.path();
    killed_at(kill, &port, 9_600, "isu address 3 9");
    // The tool says where the module is, and what was wrong with it.
    let address = patiently(|| match json(&port, "isu repair 3 9 --yes") {
        (0, objects) => Ok(what(&objects, "repaired")["address"].as_u64().unwrap()),
        (status, objects) => Err(format!("killed at {frame}: {status} {objects:?}")),
    });
    patiently(|| match json(&port, &format!("isu address {address} 9 --yes")) {
        (0, _) => Ok(()),
        (status, objects) => Err(format!("killed at {frame}: {status} {objects:?}")),
    });
    let (_, objects) = patiently(|| match json(&port, "isu info 9") {
        (0, objects) => Ok((0, objects)),
        (_, objects) => Err(format!("killed at {frame}: {objects:?}")),
    });
    let identity = what(&objects, "identity");
    assert_eq!(
        (&identity["address"], &identity["checksum_right"]),
        (&9.into(), &true.into()),
        "killed at {frame}"
    );
    assert_eq!(identity["angle_deg"], 90.0, "killed at {frame}");
}
