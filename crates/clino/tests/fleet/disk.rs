//! A full disk: a small file system of its own, which the test fills and empties.

use std::fs::File;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::Command;
use std::time::Duration;

use clino_testkit::programs::{said, skipped};

use crate::away::outcomes;
use crate::broker::{Broker, mosquitto};
use crate::gateway::Gateway;
use crate::metrics::get;
use crate::program::{CLINO, Program};
use crate::{folder, free_port, until};

/// Of the file system: an empty store takes about one and a half megabytes.
const SIZE: &str = "8m";
/// Mounts a file system that only this program and its children see, and becomes the tool in it.
const MOUNT: &str = "mount -t tmpfs -o size=$1 tmpfs \"$2\" && exec \"$3\" bridge --config \"$4\"";

/// Whether this computer lets a test mount something for itself.
fn may_mount() -> Result<(), String> {
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--mount", "sh", "-c", "mount -t tmpfs tmpfs /mnt"]);
    match command.output() {
        Ok(output) if output.status.success() => Ok(()),
        Ok(output) => Err(format!("{command:?}: {}", said(&output))),
        Err(why) => Err(format!("{command:?}: {why}")),
    }
}

/// The gauge that tells of the disk.
fn trouble(port: u16, of: &str) -> Option<String> {
    let (_, text) = get(port, "/metrics")?;
    text.lines().find_map(|line| line.strip_prefix(&format!("clino_{of}_trouble "))).map(str::to_owned)
}

/// Angles of all lines for InfluxDB, in thousandths. Each line is whole.
fn thousandths(lines: &str) -> Vec<u64> {
    let of_angles = lines.lines().filter(|line| line.starts_with("clino_angle,"));
    assert!(lines.lines().all(|line| line.starts_with("clino_")), "{lines}");
    let angles = of_angles.map(|line| line.split(" deg=").nth(1).and_then(|rest| rest.split(' ').next()));
    angles.map(|angle| angle.expect("an angle").replace('.', "").parse().expect("a number")).collect()
}

#[test]
fn a_full_disk_is_told_and_nothing_is_lost_when_there_is_room_again() {
    const TEST: &str = "fleet full disk";
    let Some(mosquitto) = mosquitto(TEST) else { return };
    if let Err(why) = may_mount() {
        return skipped(TEST, &why);
    }
    let folder = folder("disk");
    let disk = folder.join("disk");
    std::fs::create_dir(&disk).expect("a folder of this test");
    let (gateway, port, metrics) = (Gateway::new(), free_port(), free_port());
    let text = format!(
        "[[gateway]]\nname = \"north\"\nconsole = \"{}\"\n[mqtt]\nhost = \"127.0.0.1\"\nport = {port}\n\
         [store]\nfolder = \"{}\"\nmost_mb = 100\n[prometheus]\nlisten = \"127.0.0.1:{metrics}\"\n\
         [influx]\nto = \"{}\"\n",
        gateway.endpoint(),
        disk.display(),
        disk.join("lines").display()
    );
    let file = folder.join("bridge.toml");
    std::fs::write(&file, text).expect("a folder of this test");
    let mut command = Command::new("unshare");
    command.args(["--map-root-user", "--mount", "sh", "-c", MOUNT, "sh", SIZE]);
    command.arg(&disk).arg(CLINO).arg(&file);
    let bridge = Program::run(&folder, command);
    gateway.wait_for(1);
    gateway.end_line();
    let mut told = 0;
    let mut tell = |count: u32| {
        gateway.angles(count, &mut told, 1, Duration::ZERO);
        told
    };
    tell(10);
    until("the endpoint", || trouble(metrics, "store").filter(|trouble| trouble == "0"));
    // What the tool sees of its file system, from outside.
    let inside = disk.strip_prefix("/").expect("an absolute path");
    let inside = PathBuf::from(format!("/proc/{}/root", bridge.id())).join(inside);
    let filler = inside.join("filler");
    let mut full = File::create(&filler).expect("the file system of the tool");
    while full.write_all(&[0; 4_096]).is_ok() {}
    drop(full);
    let message = until("the disk's being full", || {
        tell(500);
        Some(bridge.errors()).filter(|said| said.contains("store: "))
    });
    assert!(message.contains("No space left") && message.contains("wait in memory"), "{message}");
    until("the gauge", || trouble(metrics, "store").filter(|trouble| trouble == "1"));
    until("the other gauge", || trouble(metrics, "influx").filter(|trouble| trouble == "1"));
    tell(500);
    std::fs::remove_file(&filler).expect("the file system of the tool");
    until("room again", || Some(bridge.errors()).filter(|said| said.contains("takes messages again")));
    until("the gauge", || trouble(metrics, "store").filter(|trouble| trouble == "0"));
    let last = u64::from(tell(10));
    let lines = until("the last line", || {
        // It may be read while its last line is written.
        let lines =
            std::fs::read_to_string(inside.join("lines")).ok().filter(|lines| lines.ends_with('\n'))?;
        (thousandths(&lines).last() == Some(&last)).then_some(lines)
    });
    assert_eq!(thousandths(&lines), (1..=last).collect::<Vec<_>>());
    let broker = Broker::start_with(&mosquitto, &folder, port, "allow_anonymous true\n");
    let heard = broker.listen(&mosquitto);
    // A listener that comes late has missed what a quick bridge has told it before: the rest is in order and without a hole.
    until("the last value", || (outcomes(&heard.all()).last() == Some(&last)).then_some(()));
    let got = outcomes(&heard.all());
    assert!(got.windows(2).all(|pair| pair[1] == pair[0] + 1), "{} values, {:?}…", got.len(), got.first());
    let events: Vec<_> = heard.of("clino/bridge/bridge/event").iter().map(|event| event.json()).collect();
    for what in ["store_failed", "store_works"] {
        assert!(events.iter().any(|event| event["event"] == what), "{what} in {events:?}");
    }
    assert!(bridge.end().success());
}
