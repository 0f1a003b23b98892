//! The calls of the protocol: each is passed on to the simulator's thread, which answers it.

use std::pin::Pin;
use std::sync::mpsc::SyncSender;

use tokio::sync::{mpsc, oneshot};
use tokio_stream::Stream;
use tokio_stream::wrappers::ReceiverStream;
use tonic::{Request, Response, Status, Streaming};

use super::world;
use crate::proto::v2::simlog_api_server::SimlogApi;
use crate::proto::v2::{
    InjectRequest, PubRequest, RosMessage, StepRequest, StepResponse, StepSizeRequest, TopicDescriptor,
};

/// How many messages may wait for one subscriber.
const WAITING: usize = 10_000;

type Messages = Pin<Box<dyn Stream<Item = Result<RosMessage, Status>> + Send>>;

/// What calls are passed on to.
pub(super) struct Calls(SyncSender<world::Request>);

impl Calls {
    pub(super) fn new(sender: SyncSender<world::Request>) -> Self {
        Calls(sender)
    }

    async fn ask<T>(
        &self,
        request: impl FnOnce(oneshot::Sender<Result<T, Status>>) -> world::Request,
    ) -> Result<T, Status> {
        let (sender, receiver) = oneshot::channel();
        // The channel has room for as many as may call at once, and the simulator never waits for a call.
        self.0.try_send(request(sender)).map_err(|_| Status::resource_exhausted("too many calls wait"))?;
        receiver.await.map_err(|_| Status::unavailable("the simulator is gone"))?
    }
}

#[tonic::async_trait]
impl SimlogApi for Calls {
    async fn set_step_size(&self, request: Request<StepSizeRequest>) -> Result<Response<()>, Status> {
        let milliseconds = request.into_inner().step;
        self.ask(|answer| world::Request::Begin { milliseconds, answer }).await.map(Response::new)
    }

    async fn step(&self, _: Request<StepRequest>) -> Result<Response<StepResponse>, Status> {
        let code = self.ask(|answer| world::Request::Step { answer }).await?;
        Ok(Response::new(StepResponse { code }))
    }

    async fn get_topic(&self, request: Request<TopicDescriptor>) -> Result<Response<TopicDescriptor>, Status> {
        let topic = request.into_inner();
        let name = topic.path.clone();
        self.ask(|answer| world::Request::Find { name, answer }).await?;
        Ok(Response::new(topic))
    }

    type SubscribeStream = Messages;

    async fn subscribe(&self, request: Request<TopicDescriptor>) -> Result<Response<Messages>, Status> {
        let name = request.into_inner().path;
        let (messages, receiver) = mpsc::channel(WAITING);
        self.ask(|answer| world::Request::Listen { name, messages, answer }).await?;
        Ok(Response::new(Box::pin(ReceiverStream::new(receiver))))
    }

    type InjectStream = Messages;

    async fn inject(&self, request: Request<InjectRequest>) -> Result<Response<Messages>, Status> {
        let InjectRequest { injected, target } = request.into_inner();
        let [injected, target] = [injected, target].map(|topic| topic.unwrap_or_default().path);
        let (messages, receiver) = mpsc::channel(WAITING);
        self.ask(|answer| world::Request::Cut { injected, target, messages, answer }).await?;
        Ok(Response::new(Box::pin(ReceiverStream::new(receiver))))
    }

    async fn publish(&self, request: Request<Streaming<PubRequest>>) -> Result<Response<()>, Status> {
        let mut published = request.into_inner();
        while let Some(PubRequest { topic, data }) = published.message().await? {
            let (name, data) = (topic.unwrap_or_default().path, data.unwrap_or_default());
            self.ask(|answer| world::Request::Publish { name, data, answer }).await?;
        }
        Ok(Response::new(()))
    }
}
