//! Options that some commands need and others do not have.

/// Takes a parameter that the command needs.
///
/// # Errors
/// It is missing.
pub fn need<T>(command: &str, option: &str, value: &mut Option<T>) -> Result<T, String> {
    value.take().ok_or_else(|| format!("{command} needs {option}"))
}

/// Refuses parameters that are left over: ignoring them would send something else than was meant.
///
/// # Errors
/// The first option that is still there.
pub fn refuse_others(command: &str, left: &[(&str, bool)]) -> Result<(), String> {
    match left.iter().find(|(_, given)| *given) {
        Some((option, _)) => Err(format!("{command} has no {option}")),
        None => Ok(()),
    }
}
