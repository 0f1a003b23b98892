//! The gearbox cell over SimlogAPI, version 2: the protocol of the simulator that the paper used, so whatever drives
//! that simulator can drive this cell.

use std::net::SocketAddr;
use std::process::ExitCode;

use kuka_cell_sim::{Cell, NoisyCell};
use sesame_runtime::simlog_server::{ServerOptions, serve};
use sesame_runtime::simulator::Simulator as _;

const HELP: &str = "\
The KUKA gearbox cell over SimlogAPI (simulation.server.SimlogAPI), version 2. It says where it listens, and serves until
it is ended. A run begins when a client sets the length of a step, from 1 to 50 ms.

Usage: kuka_cell_simlog --simlog ADDRESS:PORT [OPTION]…

      --simlog ADDRESS:PORT  where it listens; port 0 for any free one. An address that is not of this machine alone
                             needs a token in the environment variable SESAME_SIMLOG_TOKEN, which each call has to carry
      --noisy                with torque noise
      --seed N               the seed of the noise [default: 1]
";

/// What the arguments say.
#[derive(Debug, PartialEq, Eq)]
struct Arguments {
    address: SocketAddr,
    noisy: bool,
    seed: u64,
}

fn main() -> ExitCode {
    let arguments: Vec<String> = std::env::args().skip(1).collect();
    if arguments.iter().any(|argument| argument == "--help" || argument == "-h") {
        eprint!("{HELP}");
        return ExitCode::SUCCESS;
    }
    let Arguments { address, noisy, seed } = match read(&arguments) {
        Ok(arguments) => arguments,
        Err(wrong) => {
            eprintln!("error: {wrong}; see --help");
            return ExitCode::from(2);
        }
    };
    let token = std::env::var("SESAME_SIMLOG_TOKEN").ok();
    let options = ServerOptions { token, seed, ..ServerOptions::new(address) };
    let ready = |address: SocketAddr| println!("the gearbox cell listens at {address}");
    let served = if noisy { serve(&options, ready, NoisyCell::start) } else { serve(&options, ready, Cell::start) };
    match served {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("error: {error}");
            ExitCode::FAILURE
        }
    }
}

fn read(arguments: &[String]) -> Result<Arguments, String> {
    let (mut address, mut noisy, mut seed) = (None, false, 1);
    let mut arguments = arguments.iter();
    while let Some(option) = arguments.next() {
        if option == "--noisy" {
            noisy = true;
            continue;
        }
        let value = arguments.next().ok_or_else(|| format!("`{option}` needs a value, or is not an option"))?;
        match option.as_str() {
            "--simlog" => {
                let parsed = value.parse().map_err(|_| format!("`{value}` is not an address with a port"))?;
                address = Some(parsed);
            }
            "--seed" => seed = value.parse().map_err(|_| format!("`{value}` is not a seed"))?,
            _ => return Err(format!("there is no option `{option}`")),
        }
    }
    let address = address.ok_or("`--simlog` does not say where to listen")?;
    Ok(Arguments { address, noisy, seed })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn said(arguments: &[&str]) -> Result<Arguments, String> {
        read(&arguments.iter().map(|&argument| argument.to_owned()).collect::<Vec<_>>())
    }

    #[test]
    fn arguments_say_where_and_what() {
        let address = ([127, 0, 0, 1], 8089).into();
        let usual = Arguments { address, noisy: false, seed: 1 };
        assert_eq!(said(&["--simlog", "127.0.0.1:8089"]), Ok(usual));
        let noisy = Arguments { address, noisy: true, seed: 7 };
        assert_eq!(said(&["--noisy", "--seed", "7", "--simlog", "127.0.0.1:8089"]), Ok(noisy));
    }

    #[test]
    fn wrong_arguments_are_named() {
        let wrong = |arguments: &[&str]| said(arguments).unwrap_err();
        assert_eq!(wrong(&[]), "`--simlog` does not say where to listen");
        assert_eq!(wrong(&["--simlog"]), "`--simlog` needs a value, or is not an option");
        assert_eq!(wrong(&["--simlog", "here"]), "`here` is not an address with a port");
        assert_eq!(wrong(&["--seed", "-1"]), "`-1` is not a seed");
        assert_eq!(wrong(&["--warp", "9"]), "there is no option `--warp`");
    }
}
