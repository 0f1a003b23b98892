//! What stands in the arguments of a launched program for what its worker and its run have of their own.

use sesame_plan::{fill_placeholders, has_placeholder};

/// An argument that is replaced by a list of arguments.
const LIST: &str = "{ros-args}";

/// What a worker and its run have of their own.
#[derive(Debug, Clone)]
pub(super) struct Own {
    pub(super) worker: u32,
    pub(super) domain: u32,
    /// `None` if no text asks for it.
    pub(super) port: Option<u16>,
    pub(super) folder: String,
    pub(super) seed: u64,
    /// The values of scenes, by their names.
    pub(super) scene: Vec<(String, String)>,
}

impl Own {
    /// A text with its placeholders replaced, each once: what is put in is not looked at again.
    pub(super) fn fill(&self, text: &str) -> String {
        fill_placeholders(text, |word| self.value(word))
    }

    /// Arguments with their placeholders replaced; `list` stands for `{ros-args}`.
    pub(super) fn arguments(&self, arguments: &[String], list: &[String]) -> Vec<String> {
        let mut filled = Vec::with_capacity(arguments.len());
        for argument in arguments {
            if argument == LIST {
                filled.extend_from_slice(list);
            } else {
                filled.push(self.fill(argument));
            }
        }
        filled
    }

    fn value(&self, placeholder: &str) -> Option<String> {
        match placeholder {
            "worker" => Some(self.worker.to_string()),
            "domain" => Some(self.domain.to_string()),
            "port" => self.port.map(|port| port.to_string()),
            "folder" => Some(self.folder.clone()),
            "seed" => Some(self.seed.to_string()),
            _ => self.scene.iter().find(|(name, _)| name == placeholder).map(|(_, value)| value.clone()),
        }
    }
}

/// Whether a text asks for a port.
pub(super) fn asks_for_port(text: &str) -> bool {
    has_placeholder(text, "port")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn texts(texts: &[&str]) -> Vec<String> {
        texts.iter().map(|&text| text.to_owned()).collect()
    }

    #[test]
    fn placeholders_are_replaced_wherever_they_stand_and_nothing_else_is() {
        let own = Own {
            worker: 3,
            domain: 43,
            port: Some(20_020),
            folder: "/run/{seed}".to_owned(),
            seed: 7,
            scene: vec![("start_x".to_owned(), "-1.5".to_owned()), ("robots".to_owned(), "{worker}".to_owned())],
        };
        let arguments = texts(&[
            "--port={port}",
            "{worker}{domain}",
            "{folder}/log",
            "{ros-args}",
            "a {ros-args}",
            "{x: {seed}}",
            "start_x:={start_x}",
            "{robots}{start_y}",
            "{",
        ]);
        assert_eq!(
            own.arguments(&arguments, &texts(&["--ros-args", "-r", "a:={port}"])),
            texts(&[
                "--port=20020",
                "343",
                "/run/{seed}/log",
                "--ros-args",
                "-r",
                "a:={port}",
                "a {ros-args}",
                "{x: 7}",
                "start_x:=-1.5",
                "{worker}{start_y}",
                "{"
            ])
        );
    }
}
