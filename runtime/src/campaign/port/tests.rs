//! Attacks on the port, over real sockets.

use std::io::Write as _;
use std::sync::atomic::{AtomicBool, AtomicU32, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};

use sesame_patience as patience;

use super::*;

/// How long a port waits here: a machine that is busy must not come near to it.
const LIMIT: Duration = Duration::from_secs(60);

/// An attack on a port, as it is seen from both sides.
struct Attack {
    address: SocketAddr,
    begun: Sender<()>,
    done: AtomicBool,
    /// Bytes that were written one by one.
    written: AtomicU32,
}

impl Attack {
    /// An attack on a port that has not begun, and what tells when it has.
    fn on(port: &Port) -> (Attack, Receiver<()>) {
        let (begun, has_begun) = channel();
        let address = port.address().unwrap();
        (Attack { address, begun, done: AtomicBool::new(false), written: AtomicU32::new(0) }, has_begun)
    }

    /// The strangers have connected: now the worker comes.
    fn begin(&self) {
        self.begun.send(()).unwrap();
    }

    fn is_over(&self) -> bool {
        self.done.load(Ordering::Relaxed)
    }

    fn wait_until_over(&self) {
        patience::until("the port has done waiting", || self.is_over());
    }
}

/// What the worker with the token gets while strangers attack, and how long it took. They connect before the worker
/// does, however slow the machine is.
fn attacked(strangers: impl Fn(&Attack) + Sync) -> (io::Result<TcpStream>, Duration) {
    let port = Port::open().unwrap();
    let (address, token) = (port.address().unwrap(), port.token().to_owned());
    let (attack, has_begun) = Attack::on(&port);
    thread::scope(|scope| {
        scope.spawn(|| strangers(&attack));
        has_begun.recv_timeout(patience::LIMIT).expect("the attack begins");
        let worker = scope.spawn(move || {
            connect(address, &Hello { lock_stepped: true, end_limit: Duration::ZERO, token: Some(token) })
        });
        let started = Instant::now();
        let accepted = port.accept(LIMIT, &mut || Ok(())).map(|(stream, _)| stream);
        let took = started.elapsed();
        attack.done.store(true, Ordering::Relaxed);
        worker.join().unwrap().unwrap();
        (accepted, took)
    })
}

/// The worker's connection is found, and works, although no stranger gave up: nobody waited for one of them. Were they
/// listened to one after the other, the time of all of them together would be over first.
#[track_caller]
fn survives(strangers: impl Fn(&Attack) + Sync) {
    let (accepted, took) = attacked(strangers);
    accepted.unwrap();
    assert!(took < LIMIT / 2, "it took {took:?}");
}

#[test]
fn silent_connections_hold_up_nobody() {
    survives(|attack| {
        let silent: Vec<_> = (0..40).map(|_| TcpStream::connect(attack.address).unwrap()).collect();
        attack.begin();
        attack.wait_until_over();
        drop(silent);
    });
}

#[test]
fn more_silent_connections_than_are_listened_to_hold_up_nobody() {
    survives(|attack| {
        // As many as the system queues; the rest waits to be taken.
        let silent: Vec<_> = (0..100).map(|_| TcpStream::connect(attack.address).unwrap()).collect();
        attack.begin();
        attack.wait_until_over();
        drop(silent);
    });
}

#[test]
fn a_byte_every_so_often_holds_up_nobody_and_does_not_move_the_deadline() {
    const WHOLE: u32 = 1000;
    let slow = |attack: &Attack| {
        let mut stream = TcpStream::connect(attack.address).unwrap();
        stream.write_all(&WHOLE.to_le_bytes()).unwrap();
        attack.begin();
        while !attack.is_over() {
            stream.write_all(b" ").ok();
            attack.written.fetch_add(1, Ordering::Relaxed);
            thread::sleep(Duration::from_millis(20));
        }
    };
    survives(slow);
    // Without a worker.
    let port = Port::open().unwrap();
    let (attack, has_begun) = Attack::on(&port);
    thread::scope(|scope| {
        scope.spawn(|| slow(&attack));
        has_begun.recv_timeout(patience::LIMIT).expect("the attack begins");
        let error = port.accept(Duration::from_millis(500), &mut || Ok(())).unwrap_err();
        attack.done.store(true, Ordering::Relaxed);
        assert_eq!(error.kind(), io::ErrorKind::TimedOut, "{error}");
        // Were the deadline moved by each byte, all of them would be heard first.
        let written = attack.written.load(Ordering::Relaxed);
        assert!(written < WHOLE, "{written} bytes were written");
    });
}

#[test]
fn a_frame_of_a_gibibyte_is_refused_by_its_length() {
    let sent = AtomicBool::new(false);
    survives(|attack| {
        let mut stream = TcpStream::connect(attack.address).unwrap();
        stream.write_all(&(1u32 << 30).to_le_bytes()).unwrap();
        attack.begin();
        let mebibyte = vec![b' '; 1 << 20];
        let mut taken = 0;
        while taken < 1024 && !attack.is_over() && stream.write_all(&mebibyte).is_ok() {
            taken += 1;
        }
        // What the system buffers is not in our memory.
        assert!(taken < 64, "{taken} MiB were taken");
        sent.store(true, Ordering::Relaxed);
    });
    assert!(sent.load(Ordering::Relaxed));
}

#[test]
fn a_wrong_greeting_and_a_wrong_token_are_turned_away() {
    survives(|attack| {
        let wrong =
            serde_json::to_vec(&Hello { lock_stepped: true, end_limit: Duration::ZERO, token: Some("0".repeat(32)) })
                .unwrap();
        let none = serde_json::to_vec(&Hello { lock_stepped: true, end_limit: Duration::ZERO, token: None }).unwrap();
        for body in [wrong.as_slice(), &none, b"{}", b"GET / HTTP/1.1\r\n\r\n", &[0; 1024], b""] {
            let mut stream = TcpStream::connect(attack.address).unwrap();
            stream.write_all(&u32::try_from(body.len()).unwrap().to_le_bytes()).unwrap();
            stream.write_all(body).unwrap();
        }
        attack.begin();
    });
}

#[test]
fn a_worker_that_has_ended_ends_the_wait() {
    let port = Port::open().unwrap();
    let mut asked = 0;
    let error = port.accept(LIMIT, &mut || {
        asked += 1;
        if asked < 3 { Ok(()) } else { Err(io::Error::other("it is gone")) }
    });
    assert_eq!(error.unwrap_err().to_string(), "it is gone");
}

#[test]
fn a_worker_that_speaks_slowly_is_understood() {
    let port = Port::open().unwrap();
    let (address, token) = (port.address().unwrap(), port.token().to_owned());
    let worker = thread::spawn(move || {
        let mut whole = Vec::new();
        protocol::send(&mut whole, &Hello { lock_stepped: true, end_limit: Duration::ZERO, token: Some(token) })
            .unwrap();
        // What follows the greeting is not taken with it.
        protocol::send(&mut whole, &"what follows").unwrap();
        let mut stream = TcpStream::connect(address).unwrap();
        for part in whole.chunks(7) {
            stream.write_all(part).unwrap();
            thread::sleep(Duration::from_millis(5));
        }
    });
    let (mut stream, _) = port.accept(LIMIT, &mut || Ok(())).unwrap();
    let follows: String = protocol::receive(&mut stream).unwrap();
    assert_eq!(follows, "what follows");
    worker.join().unwrap();
}

/// All of these attacks at once, by a user who may do nothing else here.
#[test]
fn a_port_survives_what_another_user_does_to_it() {
    const ATTACK: &str = "
import socket, sys, time
port = int(sys.argv[1])
strangers = [socket.create_connection(('127.0.0.1', port)) for _ in range(40)]
slow, big = strangers[0], strangers[1]
slow.sendall((1000).to_bytes(4, 'little'))
big.setblocking(False)
big.send((1 << 30).to_bytes(4, 'little'))
print('attacking', flush=True)
while True:
    try:
        slow.send(b' ')
        big.send(b' ' * 65536)
    except OSError:
        pass
    time.sleep(0.01)
";
    if !rustix::process::geteuid().is_root() {
        eprintln!("skipped: only root can start a process of another user");
        return;
    }
    if let Err(error) = of_nobody("print('attacking', flush=True)", &[]) {
        assert!(std::env::var_os("CI").is_none(), "no process of another user can be started: {error}");
        eprintln!("skipped: no process of another user can be started: {error}");
        return;
    }
    survives(|attack| {
        let mut attacker = of_nobody(ATTACK, &[&attack.address.port().to_string()]).unwrap();
        attack.begin();
        attack.wait_until_over();
        attacker.kill().unwrap();
        attacker.wait().unwrap();
    });
}

/// A Python program as the user `nobody`, once it has said that it attacks.
fn of_nobody(script: &str, arguments: &[&str]) -> io::Result<std::process::Child> {
    use std::io::BufRead as _;
    use std::os::unix::process::CommandExt as _;
    use std::process::{Command, Stdio};

    const NOBODY: u32 = 65534;
    let mut command = Command::new("python3");
    command.args(["-c", script]).args(arguments).uid(NOBODY).gid(NOBODY).current_dir("/");
    let mut process = command.stdin(Stdio::null()).stdout(Stdio::piped()).spawn()?;
    let mut said = String::new();
    io::BufReader::new(process.stdout.take().expect("it is piped")).read_line(&mut said)?;
    if said == "attacking\n" { Ok(process) } else { Err(io::Error::other("it did not begin")) }
}
