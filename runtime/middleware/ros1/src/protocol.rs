//! What nodes of ROS 1 say to each other: XML-RPC to find each other, TCPROS for messages and calls of services.
//!
//! Texts and bytes come in and go out; connections are elsewhere. What others sent is limited in size wherever it is
//! read.

pub(crate) mod header;
pub(crate) mod http;
pub(crate) mod xmlrpc;
