//! Packages of the distribution, unpacked below a folder: nothing is installed.

use std::fs;
use std::path::Path;
use std::process::Command;

use super::done;

/// Where Debian is, and the keys that it signs with.
const DEBIAN: &str = "http://deb.debian.org/debian";
const KEYS: &str = "/usr/share/keyrings/debian-archive-keyring.gpg";

/// Has `apt-get` download the packages, and takes them apart below `root`: with the system's lists of packages if it has
/// them, else with fresh ones of our own.
pub fn unpack(root: &Path, packages: &[&str]) -> Result<(), String> {
    let packages: Vec<String> = packages.iter().map(|&package| package.to_owned()).collect();
    with_lists(root, |apt| unpack_with(root, &packages, apt))
}

/// The same with one package and all that the machine lacks of what it needs.
pub fn unpack_with_dependencies(root: &Path, package: &str) -> Result<(), String> {
    with_lists(root, |apt| unpack_with(root, &missing(package, apt)?, apt))
}

/// The same, preferably from the backports of this release, with lists of our own: a system need not have them among its
/// sources.
pub fn unpack_from_backports(root: &Path, package: &str) -> Result<(), String> {
    let release = fs::read_to_string("/etc/os-release").unwrap_or_default();
    let name = release.lines().find_map(|line| line.strip_prefix("VERSION_CODENAME=")).unwrap_or("unknown");
    // Relative ones would be below apt's own folders.
    let root = &std::path::absolute(root).map_err(|why| format!("{}: {why}\n", root.display()))?;
    let (lists, cache, sources) = (root.join("lists"), root.join("cache"), root.join("backports.list"));
    for folder in [lists.join("partial"), cache.join("archives/partial")] {
        fs::create_dir_all(&folder).map_err(|why| format!("{}: {why}\n", folder.display()))?;
    }
    fs::write(&sources, format!("deb [signed-by={KEYS}] {DEBIAN} {name}-backports main\n"))
        .map_err(|why| format!("{}: {why}\n", sources.display()))?;
    let options = [
        format!("Dir::Etc::SourceList={}", sources.display()),
        format!("Dir::State::Lists={}", lists.display()),
        format!("Dir::Cache={}", cache.display()),
        format!("APT::Default-Release={name}-backports"),
        "Debug::NoLocking=1".to_owned(),
    ];
    let apt = || {
        let mut apt = Command::new("apt-get");
        options.iter().for_each(|option| _ = apt.args(["-o", option]));
        apt
    };
    done(apt().arg("update"))?;
    unpack_with(root, &missing(package, &apt)?, &apt)
}

/// Works with an `apt-get` that has lists of packages.
fn with_lists(root: &Path, work: impl Fn(&dyn Fn() -> Command) -> Result<(), String>) -> Result<(), String> {
    let lists = root.join("lists");
    work(&|| Command::new("apt-get")).or_else(|first| {
        let state = format!("Dir::State::Lists={}", lists.display());
        fs::create_dir_all(lists.join("partial")).map_err(|why| format!("{}: {why}", lists.display()))?;
        let apt = || {
            let mut apt = Command::new("apt-get");
            apt.args(["-o", &state, "-o", "Dir::Cache::pkgcache=", "-o", "Dir::Cache::srcpkgcache="]);
            apt
        };
        let updated = done(apt().args(["-o", "Debug::NoLocking=1", "update"]));
        updated.and_then(|_| work(&apt)).map_err(|second| format!("{first}{second}"))
    })
}

/// The packages that an installation would bring, as `apt-get` says without doing it.
fn missing(package: &str, apt: &dyn Fn() -> Command) -> Result<Vec<String>, String> {
    let plan = done(apt().args(["install", "--simulate", "--no-install-recommends", package]))?;
    let plan = String::from_utf8_lossy(&plan.stdout).into_owned();
    let names = plan.lines().filter_map(|line| line.strip_prefix("Inst ")?.split(' ').next());
    Ok(names.map(str::to_owned).collect())
}

fn unpack_with(root: &Path, packages: &[String], apt: &dyn Fn() -> Command) -> Result<(), String> {
    let debs = root.join("debs");
    fs::create_dir_all(&debs).map_err(|why| format!("{}: {why}\n", debs.display()))?;
    done(apt().arg("download").args(packages).current_dir(&debs))?;
    let files = fs::read_dir(&debs).map_err(|why| format!("{}: {why}\n", debs.display()))?;
    for file in files.filter_map(Result::ok) {
        done(Command::new("dpkg").arg("-x").arg(file.path()).arg(root))?;
    }
    Ok(())
}
