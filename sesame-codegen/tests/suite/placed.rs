//! Where the tests of the generator say that runners are.

use sesame_codegen::emit::Environment;

/// A project whose runners lie two folders below its space.
pub(crate) fn environment() -> Environment {
    let path = |path: &str| {
        let mut table = toml::Table::new();
        table.insert("path".into(), path.into());
        toml::Value::Table(table)
    };
    Environment {
        dependencies: [
            ("kuka_cell_sim".to_owned(), path("../../simulator")),
            ("sesame-runtime".to_owned(), path("../../../../runtime")),
        ]
        .into(),
        lock: None,
        options: [].into(),
        space_folder: "../..".to_owned(),
        simulator_folder: "../..".to_owned(),
        ..Environment::default()
    }
}
