//! The notebook among the examples, as Jupyter runs it.

use std::fs;

use serde_json::Value;
use sesame_peers::named;
use sesame_tests::{done, workspace};

use crate::package::{CART, Place};

/// Runs all cells, and fails with the error of the first that raises something.
const EXECUTE: &str = "
import nbformat, nbclient
notebook = nbformat.read('cart.ipynb', as_version=4)
nbformat.validate(notebook)
nbclient.NotebookClient(notebook, timeout=300, kernel_name='python3').execute()
nbformat.write(notebook, 'executed.ipynb')
";

#[test]
fn the_example_runs_in_jupyter_and_shows_frames_figures_and_a_smaller_test() {
    let Some(python) = named("SESAME_PYTHON_PEERS") else { return };
    let Some(place) = Place::new("python_notebook", CART) else { return };
    let example = workspace().join("examples/notebook");
    for file in ["cart.ipynb", "cart.sesame"] {
        fs::copy(example.join(file), place.folder.join(file)).unwrap();
    }
    let mut execute = place.script(python, EXECUTE);
    let folder = |name: &str| place.folder.join(name);
    execute.env("JUPYTER_RUNTIME_DIR", folder("runtime")).env("IPYTHONDIR", folder("ipython"));
    done(execute.env("JUPYTER_CONFIG_DIR", folder("config"))).expect(0);

    let read = |path: &str| -> Value { serde_json::from_slice(&fs::read(place.folder.join(path)).unwrap()).unwrap() };
    let outputs = |path: &str| -> Vec<Value> {
        let cells = read(path)["cells"].as_array().unwrap().clone();
        cells.iter().flat_map(|cell| cell["outputs"].as_array().cloned().unwrap_or_default()).collect()
    };
    assert_eq!(outputs("cart.ipynb"), Vec::<Value>::new(), "outputs are not committed");
    let text = |value: &Value| match value {
        Value::Array(lines) => lines.iter().filter_map(Value::as_str).collect::<String>(),
        other => other.as_str().unwrap_or_default().to_owned(),
    };
    let outputs = outputs("executed.ipynb");
    let html: Vec<String> = outputs.iter().map(|output| text(&output["data"]["text/html"])).collect();
    let plain: String =
        outputs.iter().map(|output| text(&output["data"]["text/plain"]) + &text(&output["text"])).collect();
    let figures: Vec<&String> = html.iter().filter(|html| html.contains("class=\"sesame-figures\"")).collect();
    assert_eq!(figures.len(), 3, "a run and two tests");
    assert!(figures[0].contains("<svg class=\"scatter\"") && figures[0].contains("violate it"));
    assert!(figures[1].contains("<figure class=\"timeline\"") && figures[2].contains("<figure class=\"timeline\""));
    assert_eq!(html.iter().filter(|html| html.contains("class=\"dataframe\"")).count(), 2);
    assert!(plain.contains("<Run first of cart, seed 1: 80 tests, front of "), "{plain}");
    assert!(plain.contains("test smallest {") && plain.contains("expect R1"), "{plain}");
}
