//! Commands that messages and pages propose, written so that they can be pasted into a shell.

/// An argument as the shells of POSIX read it: in quotes if they would read something else in it. Control characters
/// are left out: a terminal would interpret them.
pub fn quoted(argument: &str) -> String {
    let plain = |sign: char| sign.is_ascii_alphanumeric() || "_-./:=@%+,".contains(sign);
    if !argument.is_empty() && argument.chars().all(plain) {
        return argument.to_owned();
    }
    let printable: String = argument.chars().filter(|sign| !sign.is_control()).collect();
    format!("'{}'", printable.replace('\'', r"'\''"))
}

/// A file as an argument: never read as an option.
pub fn quoted_file(file: &str) -> String {
    let quoted = quoted(file);
    if file.trim_start_matches(char::is_control).starts_with('-') { format!("./{quoted}") } else { quoted }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_shell_reads_an_argument_as_it_was() {
        assert_eq!(quoted("results/42"), "results/42");
        assert_eq!(quoted("my cell.sesame"), "'my cell.sesame'");
        assert_eq!(quoted("it's"), r"'it'\''s'");
        assert_eq!(quoted(""), "''");
        assert_eq!(quoted("$(reboot)"), "'$(reboot)'");
        assert_eq!(quoted("a\u{1b}[2J\n"), "'a[2J'");
    }

    #[test]
    fn a_file_is_never_an_option() {
        assert_eq!(quoted_file("-rf"), "./-rf");
        assert_eq!(quoted_file("\n-r f"), "./'-r f'");
        assert_eq!(quoted("--campaign"), "--campaign");
    }
}
