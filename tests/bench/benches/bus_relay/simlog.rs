//! Steps of a simulator that speaks SimlogAPI, with one topic that is cut.

use std::net::SocketAddr;
use std::path::PathBuf;
use std::sync::mpsc;
use std::time::{Duration, Instant};

use sesame_base::time::SimTime;
use sesame_bench::ways::{Measured, plan, print, rounds, while_relayed};
use sesame_relay::simulator::{Bus, Port, Progress, Setup, Simulator, SimulatorError};
use sesame_simlog::proto::v2::simlog_api_client::SimlogApiClient;
use sesame_simlog::proto::v2::{InjectRequest, PubRequest, RosMessage, StepRequest, StepSizeRequest, TopicDescriptor};
use sesame_simlog::server;
use tokio::runtime::{Builder, Runtime};
use tokio::task::JoinHandle;
use tonic::Streaming;
use tonic::codegen::tokio_stream::once;
use tonic::transport::{Channel, Endpoint};

use crate::{Size, space};

/// A simulator that publishes a number in each step, and hears it.
struct Joint {
    port: Port,
}

impl Simulator for Joint {
    fn start(_: &Setup, bus: &mut Bus<'_>) -> Result<Self, SimulatorError> {
        let port = bus.open("joint");
        bus.subscribe(port);
        Ok(Joint { port })
    }

    fn step(&mut self, bus: &mut Bus<'_>) -> Result<Progress, SimulatorError> {
        while bus.receive(self.port).is_some() {}
        bus.publish(self.port, 0.5);
        Ok(Progress::Running)
    }
}

/// Serves a simulator until the process ends.
fn served() -> SocketAddr {
    let (sender, receiver) = mpsc::channel();
    let options = server::ServerOptions::new(([127, 0, 0, 1], 0).into());
    std::thread::spawn(move || {
        server::serve(&options, |address| sender.send(address).expect("it is awaited"), Joint::start)
    });
    receiver.recv_timeout(Duration::from_secs(10)).expect("it listens")
}

fn topic(path: &str) -> TopicDescriptor {
    TopicDescriptor { path: path.to_owned(), msg_type: String::new() }
}

/// A client that steps a simulator of its own: it listens to the topic, or cuts it and passes it on.
struct Bare {
    runtime: Runtime,
    client: SimlogApiClient<Channel>,
    heard: Streaming<RosMessage>,
    cuts: bool,
}

impl Bare {
    fn new(cuts: bool) -> Bare {
        let address = served();
        let runtime = Builder::new_current_thread().enable_all().build().expect("a runtime can be made");
        let (client, heard) = runtime.block_on(async {
            let endpoint = Endpoint::from_shared(format!("http://{address}")).expect("it is an address");
            let channel = endpoint.tcp_nodelay(true).connect().await.expect("it listens");
            let mut client = SimlogApiClient::new(channel);
            client.set_step_size(StepSizeRequest { step: 20 }).await.expect("it begins");
            let mut listener = client.clone();
            // Its answer comes with the first message.
            let listening: JoinHandle<Streaming<RosMessage>> = tokio::spawn(async move {
                let stream = if cuts {
                    let cut = InjectRequest { injected: Some(topic("joint/shadow")), target: Some(topic("joint/in")) };
                    listener.inject(cut).await
                } else {
                    listener.subscribe(topic("joint/in")).await
                };
                stream.expect("it can be listened to").into_inner()
            });
            tokio::time::sleep(Duration::from_millis(200)).await;
            client.step(StepRequest {}).await.expect("it steps");
            let mut heard = listening.await.expect("nothing panics");
            heard.message().await.expect("it is there").expect("it goes on");
            (client, heard)
        });
        Bare { runtime, client, heard, cuts }
    }

    fn step(&mut self) {
        let Bare { runtime, client, heard, cuts } = self;
        runtime.block_on(async {
            client.step(StepRequest {}).await.expect("it steps");
            let message = heard.message().await.expect("it is there").expect("it goes on");
            if *cuts {
                let passed = PubRequest { topic: Some(topic("joint/shadow")), data: Some(message) };
                client.publish(once(passed)).await.expect("it is taken");
            }
        });
    }
}

/// How long each of so many steps takes.
fn steps(count: u64, mut step: impl FnMut()) -> Measured {
    let begin = Instant::now();
    let mut latencies: Vec<u64> = (0..count)
        .map(|_| {
            let begin = Instant::now();
            step();
            u64::try_from(begin.elapsed().as_nanos()).expect("it is soon over")
        })
        .collect();
    latencies.sort_unstable();
    Measured { latencies, seconds: begin.elapsed().as_secs_f64() }
}

pub(crate) fn run(size: Size) {
    let simulator = format!("simlog \"http://{}\" {{ step 20ms }}", served());
    let joint = "topic peer = \"joint\" : real\n  node robot { publishes peer  subscribes peer  every step peer }";
    let plan = plan(&space(&simulator, joint, "peer"));
    let (mut direct, mut bare) = (Bare::new(false), Bare::new(true));
    while_relayed(&plan, &sesame_simlog::simlog(PathBuf::from(".")), |advance| {
        let mut ways: [Box<dyn FnMut() + '_>; 3] = [
            Box::new(|| direct.step()),
            Box::new(|| bare.step()),
            Box::new(|| advance(SimTime::from_nanos(20_000_000))),
        ];
        rounds(&mut ways, 1, |step| steps(20, step));
        let results = rounds(&mut ways, size.rounds, |step| steps(size.messages, step));
        print("SimlogAPI, one step", &["direct", "a forwarder of messages", "Sesame"], &results);
    });
}
