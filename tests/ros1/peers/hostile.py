"""Does to a node what nobody should: broken headers, endless lengths, half frames, wrong questions; and is a publisher
that sends messages that are none.

    hostile.py NODE TOPIC

It says what became of each attempt. It needs no rospy, so that nothing is right by accident.
"""

import os
import socket
import struct
import sys
import threading
import urllib.parse
import xmlrpc.client
import xmlrpc.server

from common import go, say


def field(text):
    return struct.pack("<I", len(text)) + text.encode()


def framed(*fields):
    body = b"".join(map(field, fields))
    return struct.pack("<I", len(body)) + body


def main():
    node, topic = sys.argv[1:3]
    master = xmlrpc.client.ServerProxy(os.environ["ROS_MASTER_URI"])
    uri = master.lookupNode("/hostile", node)[2]
    asked = urllib.parse.urlsplit(uri)
    slave = xmlrpc.client.ServerProxy(uri)
    code, _, (_, host, port) = slave.requestTopic("/hostile", topic, [["TCPROS"]])
    outcomes = {"offered": code == 1, "loopback": host == "127.0.0.1"}

    def attempt(name, address, sent, wait=True):
        with socket.create_connection(address, timeout=60) as peer:
            peer.sendall(sent)
            if not wait:
                outcomes[name] = "left"
                return
            try:
                peer.shutdown(socket.SHUT_WR)
                outcomes[name] = peer.recv(4096).decode(errors="replace")[8:]
            except OSError as error:
                outcomes[name] = str(error)

    messages, questions = (host, port), (asked.hostname, asked.port)
    attempt("nothing", messages, b"")
    attempt("endless", messages, b"\xff\xff\xff\xff")
    attempt("half", messages, struct.pack("<I", 100) + b"abc", wait=False)
    attempt("no value", messages, framed("topic"))
    attempt("beyond", messages, struct.pack("<II", 8, 1000) + b"abcd")
    attempt("neither", messages, framed("callerid=/hostile"))
    attempt("no topic", messages, framed("callerid=/hostile", "topic=/nowhere", "md5sum=*", "type=*"))
    attempt("wrong type", messages, framed("callerid=/hostile", f"topic={topic}", "md5sum=1", "type=a/B"))
    attempt("no service", messages, framed("callerid=/hostile", "service=/nowhere", "md5sum=*"))
    attempt("no http", questions, b"\x00\x01\x02\r\n\r\n")
    attempt("long body", questions, b"POST / HTTP/1.1\r\nContent-Length: 99999999999\r\n\r\n")
    attempt("no xml", questions, b"POST / HTTP/1.1\r\nContent-Length: 3\r\n\r\n<<<")
    outcomes["shutdown"] = slave.shutdown("/hostile", "because I say so")[0]
    outcomes["unknown"] = slave.doSomething("/hostile")[0]
    outcomes["bad update"] = slave.publisherUpdate("/hostile", f"{topic}/undisturbed", ["not a uri", 7, "http://"])[0]

    # A publisher: first one with another type, then one whose messages are none, and whose last frame has no end.
    server = xmlrpc.server.SimpleXMLRPCServer(("127.0.0.1", 0), logRequests=False, allow_none=True)
    listener = socket.create_server(("127.0.0.1", 0))
    at = listener.getsockname()[1]
    server.register_function(lambda *_: [1, "", ["TCPROS", "127.0.0.1", at]], "requestTopic")
    threading.Thread(target=server.serve_forever, daemon=True).start()
    mine = f"http://127.0.0.1:{server.server_address[1]}/"
    md5 = "992ce8a1687cec8c8bd883ec73ca41d1"
    headers = [
        struct.pack("<I", 0xFFFFFFFF),
        framed("callerid=/hostile", "type"),
        framed("callerid=/hostile", "type=std_msgs/Int8", "md5sum=1"),
        framed("callerid=/hostile", "type=std_msgs/String", "md5sum=of my own"),
        framed("callerid=/hostile", "type=std_msgs/String", f"md5sum={md5}", "message_definition=what string?"),
    ]
    listener.settimeout(120)
    outcomes["registered"] = master.registerPublisher("/hostile", f"{topic}/undisturbed", "std_msgs/String", mine)[0]
    for header in headers:
        peer, _ = listener.accept()
        peer.settimeout(60)
        length = struct.unpack("<I", peer.recv(4, socket.MSG_WAITALL))[0]
        peer.recv(length, socket.MSG_WAITALL)
        peer.sendall(header)
        if header is headers[-1]:
            peer.sendall(struct.pack("<II", 4, 1000))
            peer.sendall(struct.pack("<I", 1 << 31))
            outcomes["last frame"] = peer.recv(1) == b""
        peer.close()
    outcomes["unregistered"] = master.unregisterPublisher("/hostile", f"{topic}/undisturbed", mine)[0]
    say(outcomes)
    go()


if __name__ == "__main__":
    main()
