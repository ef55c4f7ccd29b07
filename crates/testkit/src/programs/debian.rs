//! Packages of the distribution, unpacked below a folder: nothing is installed.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::done;

/// Has `apt-get` download the packages, and takes them apart below `root`: with the system's lists of packages if it has
/// them, else with fresh ones of our own.
pub fn unpack(root: &Path, packages: &[&str]) -> Result<(), String> {
    let lists = root.join("lists");
    unpack_with(root, packages, &mut Command::new("apt-get")).or_else(|first| {
        let state = format!("Dir::State::Lists={}", lists.display());
        fs::create_dir_all(lists.join("partial")).map_err(|why| format!("{}: {why}", lists.display()))?;
        let apt = || {
            let mut apt = Command::new("apt-get");
            apt.args(["-o", &state, "-o", "Dir::Cache::pkgcache=", "-o", "Dir::Cache::srcpkgcache="]);
            apt
        };
        let updated = done(apt().args(["-o", "Debug::NoLocking=1", "update"]));
        updated
            .and_then(|_| unpack_with(root, packages, &mut apt()))
            .map_err(|second| format!("{first}{second}"))
    })
}

fn unpack_with(root: &Path, packages: &[&str], apt: &mut Command) -> Result<(), String> {
    let debs = root.join("debs");
    fs::create_dir_all(&debs).map_err(|why| format!("{}: {why}\n", debs.display()))?;
    done(apt.arg("download").args(packages).current_dir(&debs))?;
    let files = fs::read_dir(&debs).map_err(|why| format!("{}: {why}\n", debs.display()))?;
    for file in files.filter_map(Result::ok) {
        done(Command::new("dpkg").arg("-x").arg(file.path()).arg(root))?;
    }
    Ok(())
}
