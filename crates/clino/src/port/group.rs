//! The group that may open a device, by its name.

use std::fs;
use std::os::unix::fs::MetadataExt as _;
use std::path::Path;

const GROUPS: &str = "/etc/group";

/// The name of the group that owns `path`, if its members may open it.
pub fn of(path: &Path) -> Option<String> {
    let metadata = fs::metadata(path).ok()?;
    // Read and write for the group.
    let may = metadata.mode() & 0o060 == 0o060;
    may.then(|| name(&fs::read_to_string(GROUPS).ok()?, metadata.gid())).flatten()
}

/// The name of a group, from the system's list: `name:password:number:members`.
fn name(list: &str, number: u32) -> Option<String> {
    let mut groups = list.lines().map(|line| line.split(':'));
    let group = groups.find_map(|mut fields| {
        let name = fields.next()?;
        (fields.nth(1)?.parse() == Ok(number)).then_some(name)
    });
    group.map(str::to_owned)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_group_is_found_by_its_number() {
        let list = "root:x:0:\nno line\ndialout:x:20:ann,bob\n";
        assert_eq!(name(list, 20).as_deref(), Some("dialout"));
        assert_eq!(name(list, 0).as_deref(), Some("root"));
        assert_eq!(name(list, 2), None);
    }
}
