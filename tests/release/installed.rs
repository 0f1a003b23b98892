//! What users install of a release, on a machine without Rust: an empty folder, and a PATH with nothing of this one.

use std::fs;
use std::os::unix::fs::PermissionsExt as _;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

use sesame_tests::{Done, command, done, fresh_folder, sesamec, workspace};

use crate::files::file;
use crate::steps::{Action, Checkout, SPACE, on_path, put, read};

/// The newest glibc that programs may ask for: that of manylinux2014.
const GLIBC: u32 = 17;

/// A machine of somebody who tries Sesame: an empty folder, and these folders alone on the PATH.
struct Machine {
    folder: PathBuf,
    path: Vec<PathBuf>,
}

impl Machine {
    fn new(name: &str) -> Self {
        Machine { folder: fresh_folder(&format!("release-{name}")), path: Vec::new() }
    }

    fn command(&self, program: impl AsRef<Path>) -> Command {
        let mut command = Command::new(self.found(program.as_ref()));
        command.current_dir(&self.folder).env_clear().env("HOME", &self.folder);
        command.env("PATH", std::env::join_paths(&self.path).expect("no colon")).env("LC_ALL", "C.UTF-8");
        command
    }

    /// Where this machine has a program: the PATH of the test is another one.
    fn found(&self, program: &Path) -> PathBuf {
        let places = self.path.iter().map(|folder| folder.join(program));
        places.into_iter().find(|place| place.is_file()).unwrap_or_else(|| program.to_owned())
    }

    fn sesamec(&self, arguments: &[&str]) -> Done {
        let mut sesamec = self.command("sesamec");
        timed(&format!("sesamec {}", arguments.join(" ")), sesamec.args(arguments))
    }

    /// The way from nothing to a page that every installation has to go, and the digest of its results.
    #[track_caller]
    fn first_front(&self) -> String {
        assert!(!self.has("cargo") && !self.has("rustc"), "this machine has Rust");
        self.sesamec(&["new", "--python", "demo"]).expect(0);
        let ran = self.sesamec(&["run", "demo/demo.sesame"]).expect(0);
        self.sesamec(&["report", "demo/demo.sesame"]).expect(0);
        assert!(self.folder.join("demo/runners/first/results/1/report.html").is_file());
        ran.digest()
    }

    fn has(&self, program: &str) -> bool {
        self.path.iter().any(|folder| folder.join(program).exists())
    }

    /// Python with the wheel, in an environment of its own, and nothing else.
    fn with_wheel(name: &str) -> Option<Self> {
        if !sesame_peers::has_python3() {
            return None;
        }
        let mut machine = Machine::new(name);
        done(command("python3").args(["-m", "venv", "venv"]).current_dir(&machine.folder)).expect(0);
        machine.path.push(machine.folder.join("venv/bin"));
        let wheel = file("sesamec-", ".whl");
        let mut pip = machine.command("pip");
        pip.args(["install", "--quiet", "--disable-pip-version-check", "--no-index"]).arg(&wheel);
        timed("pip install", &mut pip).expect(0);
        Some(machine)
    }
}

/// Runs a command to its end, and prints what it took.
fn timed(what: &str, command: &mut Command) -> Done {
    let begin = Instant::now();
    let done = done(command);
    eprintln!("{what}: {:.2} s", begin.elapsed().as_secs_f64());
    done
}

/// The digest that this workspace's own program comes to.
fn expected(name: &str) -> String {
    let folder = fresh_folder(&format!("release-{name}-expected"));
    done(command(sesamec()).args(["new", "--python", "demo"]).current_dir(&folder)).expect(0);
    done(command(sesamec()).args(["run", "demo/demo.sesame"]).current_dir(&folder)).expect(0).digest()
}

/// Insists that a program or library asks for no newer glibc than promised, and speaks of no folder of this machine.
#[track_caller]
fn portable(file: &Path) {
    let bytes = fs::read(file).expect("it can be read");
    let text = String::from_utf8_lossy(&bytes);
    let wanted = text.split("GLIBC_2.").skip(1);
    let wanted = wanted.filter_map(|rest| rest.split(|c: char| !c.is_ascii_digit()).next()?.parse::<u32>().ok());
    let newest = wanted.max();
    eprintln!("{}: {:.1} MB, glibc {newest:?}", file.display(), bytes.len() as f64 / 1e6);
    assert!(newest.is_none_or(|newest| newest <= GLIBC), "{} wants glibc 2.{newest:?}", file.display());
    let home = std::env::var("HOME").expect("there is a home");
    for folder in [workspace().display().to_string(), format!("{home}/.cargo"), format!("{home}/.rustup")] {
        assert!(!text.contains(&folder), "{} speaks of {folder}", file.display());
    }
}

/// The package that a wheel installs into an environment.
fn package(machine: &Machine) -> PathBuf {
    let print = "import sesamec, pathlib; print(pathlib.Path(sesamec.__file__).parent)";
    PathBuf::from(done(machine.command("python").args(["-c", print])).expect(0).out.trim())
}

#[test]
#[ignore = "long: makes a release"]
fn the_wheel_gives_a_front_without_rust() {
    let Some(machine) = Machine::with_wheel("wheel") else { return };
    let wheel = file("sesamec-", ".whl");
    let name = wheel.file_name().and_then(|name| name.to_str()).expect("it is text");
    assert!(name.contains("-cp310-abi3-") && name.contains("manylinux_2_17_x86_64"), "{name}");
    let size = fs::metadata(&wheel).expect("it is there").len();
    eprintln!("{name}: {:.1} MB", size as f64 / 1e6);

    let program = machine.folder.join("venv/bin/sesamec");
    assert_eq!(fs::metadata(&program).expect("it is installed").permissions().mode() & 0o111, 0o111);
    assert!(fs::read(&program).expect("it can be read").starts_with(b"\x7fELF"), "the program is native");
    portable(&program);
    let package = package(&machine);
    portable(&package.join("_native.abi3.so"));
    assert!(package.join("py.typed").is_file());

    timed("import sesamec", machine.command("python").args(["-c", "import sesamec"])).expect(0);
    assert_eq!(machine.first_front(), expected("wheel"));

    // The program and the module of one wheel work together.
    let in_process = "import sys; sys.path.insert(0, 'demo')\nimport sesamec\n\
        class World:\n    subscribes = ['cart/position', 'cart/command']\n    \
        publishes = ['cart/clearance', *subscribes]\n    def __init__(self, setup): pass\n    \
        def step(self, bus):\n        bus.messages()\n        \
        for topic in self.publishes: bus.publish(topic, 5.0)\n\
        print(sesamec.run('demo/demo.sesame', simulator=World, evaluations=4, results='here', \
        options=['--allow-unheard', '--fail-on', 'nothing'])['digest'])";
    let ran = timed("sesamec.run, in process", machine.command("python").args(["-c", in_process])).expect(0);
    assert_eq!(ran.out.trim().len(), 64, "{}", ran.out);
}

#[test]
#[ignore = "long: makes a release, and compiles a runner"]
fn a_campaign_in_rust_says_what_it_needs_and_runs_with_released_crates() {
    let Some(mut machine) = Machine::with_wheel("rust") else { return };
    // The crates around the project take the place of those in the registry.
    let crates = file("sesame-crates-", ".tar.gz");
    done(command("tar").arg("xzf").arg(&crates).args(["--strip-components", "1"]).current_dir(&machine.folder))
        .expect(0);
    machine.sesamec(&["new", "demo"]).expect(0);
    let listed = |folder: &str| fs::read_dir(machine.folder.join(folder)).expect("it is there").count();
    let before = listed("demo");
    let refused = machine.sesamec(&["run", "demo/demo.sesame"]).expect(1).err;
    assert_eq!(listed("demo"), before, "nothing is generated that cannot be built");
    for said in [
        "the simulator `",
        "` and the metric `close_calls` are in Rust",
        "no `cargo` on PATH",
        "https://rustup.rs",
        "GB",
        "minutes",
        "Python",
    ] {
        assert!(refused.contains(said), "{said}:\n{refused}");
    }
    machine.sesamec(&["generate", "demo/demo.sesame"]).expect(0);
    let manifest = read(&machine.folder.join("demo/runners/first/Cargo.toml"));
    let released = format!("sesame-runtime = \"={}\"", env!("CARGO_PKG_VERSION"));
    assert!(manifest.contains(&released), "{manifest}");

    let hook = machine.folder.join("demo/runners/hooks/close_calls.rs");
    let stub = read(&hook);
    let filled = stub.replace("ctx.unimplemented();", "if clearance < 0.5 && ctx.every_seconds(0.2) { ctx.add(1.0); }");
    assert_ne!(stub, filled);
    fs::write(&hook, filled).expect("a hook can be written");

    let cargo = Path::new(env!("CARGO")).parent().expect("it is in a folder").to_owned();
    machine.path.extend([cargo, "/usr/bin".into(), "/bin".into()]);
    let mut run = machine.command("sesamec");
    // The crates of others are in cargo's cache, which is not in the new home.
    let home = std::env::var_os("HOME").expect("there is a home");
    let of_cargo = std::env::var_os("CARGO_HOME").unwrap_or_else(|| Path::new(&home).join(".cargo").into());
    let rustup = std::env::var_os("RUSTUP_HOME").unwrap_or_else(|| Path::new(&home).join(".rustup").into());
    run.env("CARGO_HOME", of_cargo).env("RUSTUP_HOME", rustup);
    let ran = timed("sesamec run, with a runner to compile", run.args(["run", "demo/demo.sesame"])).expect(0);
    ran.digest();
    assert!(!ran.err.contains("warning"), "{}", ran.err);
    let target = machine.folder.join("demo/runners/target");
    eprintln!("{}", done(command("du").arg("-sh").arg(target)).out.trim());
}

#[test]
#[ignore = "long: makes a release"]
fn the_static_program_runs_anywhere_with_its_pages() {
    let mut machine = Machine::new("static");
    let archive = file("sesamec-", "-unknown-linux-musl.tar.gz");
    done(command("tar").arg("xzf").arg(&archive).args(["--strip-components", "1"]).current_dir(&machine.folder))
        .expect(0);
    portable(&machine.folder.join("sesamec"));
    let said = done(command("file").arg("-L").arg(machine.folder.join("sesamec")));
    eprintln!("{}", said.out.trim());
    for part in
        ["README.md", "CHANGELOG.md", "LICENSE-APACHE", "LICENSE-MIT", "third-party-licences.txt", "Containerfile"]
    {
        assert!(machine.folder.join(part).is_file(), "{part}");
    }
    for page in ["sesamec.1", "sesamec-run.1", "sesamec-lab-brief.1"] {
        assert!(read(&machine.folder.join("man").join(page)).starts_with(".ie"), "{page}");
    }
    assert!(read(&machine.folder.join("completions/sesamec.bash")).contains("complete -F _sesamec"));
    let Some(python) = python_alone(&machine) else { return };
    machine.path.extend([machine.folder.clone(), python]);
    assert_eq!(machine.first_front(), expected("static"));
}

/// A folder with `python3` and nothing else.
fn python_alone(machine: &Machine) -> Option<PathBuf> {
    if !sesame_peers::has_python3() {
        return None;
    }
    let print = "import sys; print(sys.executable)";
    let python = done(command("python3").args(["-c", print])).expect(0).out;
    let folder = machine.folder.join("python");
    fs::create_dir(&folder).expect("a folder can be made");
    std::os::unix::fs::symlink(python.trim(), folder.join("python3")).expect("a link can be made");
    Some(folder)
}

#[test]
#[ignore = "long: makes a release"]
fn the_debian_package_installs_the_program_its_pages_and_completions() {
    if sesame_peers::installed(&["dpkg"], &["--version"]).is_none() {
        return;
    }
    let mut machine = Machine::new("deb");
    let package = file("sesamec_", "_amd64.deb");
    let root = machine.folder.join("root");
    for folder in ["var/lib/dpkg/info", "var/lib/dpkg/updates"] {
        fs::create_dir_all(root.join(folder)).expect("a folder can be made");
    }
    fs::write(root.join("var/lib/dpkg/status"), "").expect("a file can be written");
    fs::write(root.join("var/lib/dpkg/available"), "").expect("a file can be written");
    // A system without anything else: not even the C library, which is that of this machine.
    let mut install = command("dpkg");
    install.arg(format!("--root={}", root.display())).args(["--force-not-root", "--force-depends", "--install"]);
    timed("dpkg --install", install.arg(&package)).expect(0);
    for part in [
        "usr/share/man/man1/sesamec-run.1.gz",
        "usr/share/bash-completion/completions/sesamec",
        "usr/share/zsh/vendor-completions/_sesamec",
        "usr/share/fish/vendor_completions.d/sesamec.fish",
        "usr/share/doc/sesamec/copyright",
        "usr/share/doc/sesamec/changelog.Debian.gz",
        "usr/share/doc/sesamec/third-party-licences.gz",
    ] {
        assert!(root.join(part).is_file(), "{part}");
    }
    if on_path("man") {
        let mut man = command("man");
        man.arg("--local-file").arg(root.join("usr/share/man/man1/sesamec-run.1.gz")).env("MANROFFOPT", "-ww");
        let shown = done(&mut man).expect(0);
        assert!(shown.out.contains("--campaign") && shown.err.is_empty(), "{}\n{}", shown.out, shown.err);
    }
    portable(&root.join("usr/bin/sesamec"));
    let Some(python) = python_alone(&machine) else { return };
    machine.path.extend([root.join("usr/bin"), python]);
    assert_eq!(machine.first_front(), expected("deb"));
}

#[test]
#[ignore = "long: makes a release, and builds an image"]
fn the_image_that_the_recipe_makes_runs_a_campaign() {
    if sesame_peers::installed(&["buildah"], &["--version"]).is_none() {
        return;
    }
    let machine = Machine::new("container");
    let archive = file("sesamec-", "-unknown-linux-musl.tar.gz");
    done(command("tar").arg("xzf").arg(&archive).args(["--strip-components", "1"]).current_dir(&machine.folder))
        .expect(0);
    let store = ["--root", "images", "--runroot", "images-run", "--storage-driver", "vfs"];
    let buildah = |what: &str, arguments: &[&str]| {
        let mut buildah = command("buildah");
        buildah.args(store).args(arguments).current_dir(&machine.folder);
        timed(what, &mut buildah)
    };
    buildah("buildah bud", &["bud", "--quiet", "--isolation", "chroot", "--tag", "sesamec", "."]).expect(0);
    let container = buildah("buildah from", &["from", "sesamec"]).expect(0).out.trim().to_owned();
    let work = machine.folder.join("work");
    fs::create_dir(&work).expect("a folder can be made");
    let work = format!("{}:/work", work.display());
    // In the image alone: nothing but the program.
    let run = |mounted: &[&str], arguments: &[&str]| {
        let mut all = vec!["run", "--isolation", "chroot", "--volume", &work];
        for folder in mounted {
            all.extend(["--volume", folder]);
        }
        all.extend([container.as_str(), "--", "/usr/bin/sesamec"]);
        all.extend(arguments);
        buildah(&format!("in the image: sesamec {}", arguments.join(" ")), &all)
    };
    assert!(run(&[], &["--version"]).expect(0).out.contains(env!("CARGO_PKG_VERSION")));
    run(&[], &["new", "--python", "demo"]).expect(0);
    run(&[], &["check", "demo/demo.sesame"]).expect(0);
    let refused = run(&[], &["run", "demo/demo.sesame"]);
    assert!(refused.code != Some(0) && refused.err.contains("python3"), "{refused:?}");
    fs::remove_dir_all(machine.folder.join("work/demo")).expect("it can be removed");
    // With the Python of this machine, in place of an image that has one.
    let python = done(command("python3").args(["-c", "import sys; print(sys.base_prefix)"])).expect(0).out;
    let python = python.trim();
    let own = format!("{python}:{python}:ro");
    let mut mounted = vec!["/lib:/lib:ro", "/lib64:/lib64:ro", "/usr/lib:/usr/lib:ro"];
    if !python.is_empty() && python != "/usr" {
        mounted.push(&own);
    }
    let path = format!("PATH={python}/bin:/usr/bin");
    buildah("buildah config", &["config", "--env", &path, &container]).expect(0);
    run(&mounted, &["new", "--python", "demo"]).expect(0);
    let ran = run(&mounted, &["run", "demo/demo.sesame"]).expect(0);
    run(&mounted, &["report", "demo/demo.sesame"]).expect(0);
    assert!(machine.folder.join("work/demo/runners/first/results/1/report.html").is_file());
    assert_eq!(ran.digest(), expected("container"));
    buildah("buildah rm", &["rm", &container]).expect(0);
}

#[test]
#[ignore = "long: makes a release"]
fn the_action_installs_a_wheel_and_uses_it() {
    let Some(checkout) = Checkout::new("action-wheel") else { return };
    let mut checkout = checkout.without_sesamec();
    let wheel = file("sesamec-", ".whl");
    let name = wheel.file_name().and_then(|name| name.to_str()).expect("it is text");
    put(&wheel, &checkout.folder.join(name));
    let action = Action::read(&read(&workspace().join("action.yml")));
    let with = [("file", SPACE), ("wheel", &format!("./{name}")), ("arguments", "--evaluations 12")];
    let job = checkout.run(&action, "Install sesamec", &with);
    assert_eq!(job.ran[0].1.code, Some(0), "{job:?}");
    assert_eq!(job.last(), ("Run the campaign", Some(3)), "{job:?}");
    assert!(checkout.has(&job.outputs["run.page"]));
}
