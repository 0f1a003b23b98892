//! Where the numbers of a study come from: each results file, what made it, and who was in the lab.

use sesame_present::markup::Markup;
use sesame_record::{RecordError, Repository};

/// A table with a row per results file.
pub(crate) fn provenance(body: &mut Markup, files: &[(&str, &Repository)]) -> Result<(), RecordError> {
    body.open("div", &[("class", "scroll")]);
    body.open("table", &[]);
    body.open("thead", &[]);
    body.open("tr", &[]);
    for title in ["Part", "Results", "Runs", "Seed", "Made by", "When, who, with what", "Digest"] {
        body.element("th", &[], title);
    }
    body.close();
    body.close();
    body.open("tbody", &[]);
    for (part, repository) in files {
        let facts = repository.campaign();
        // The reference run is one of the runs without disturbance.
        let runs = match repository.task().undisturbed() {
            Some(_) => repository.numbers()?.len(),
            None => repository.evaluated()?,
        };
        body.open("tr", &[]);
        body.element("th", &[], part);
        let folder = repository
            .folder()
            .file_name()
            .map_or_else(|| repository.path().display().to_string(), |name| name.to_string_lossy().into_owned());
        body.element("td", &[], &folder);
        body.element("td", &[("class", "number")], &runs.to_string());
        body.element("td", &[("class", "number")], &facts.seed.to_string());
        body.element("td", &[], &format!("{}, sesame-runtime {}", facts.plan.generator, facts.runtime));
        body.element("td", &[], &people(repository)?);
        body.open("td", &[]);
        let digest = repository.digest()?;
        body.element("code", &[], digest.get(..16).unwrap_or(&digest));
        body.close();
        body.close();
    }
    body.close();
    body.close();
    body.close();
    Ok(())
}

/// When and on which host results were recorded, and what people entered with the runs that they made in a lab; each
/// once.
fn people(repository: &Repository) -> Result<String, RecordError> {
    let mut said = repository.days()?;
    for run in repository.entered_runs()? {
        for text in run.provenance.texts().into_iter().flatten() {
            if !said.iter().any(|known| known == text) {
                said.push(text.to_owned());
            }
        }
    }
    Ok(if said.is_empty() { "–".to_owned() } else { said.join(", ") })
}
