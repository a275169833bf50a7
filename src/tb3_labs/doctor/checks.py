"""Checks this computer and a robot. Each Finding is yielded as soon as it is known."""
import os
import time
from dataclasses import replace

from tb3_labs.doctor.computer import is_own, judge_address, outgoing_address, this_computer
from tb3_labs.doctor.master_and_nodes import (
    Peer, RobotGraph, judge_master, judge_names, judge_nodes, judge_return_path, judge_robot)
from tb3_labs.doctor.programs import judge_programs
from tb3_labs.doctor.ros_listening import examine_messages


def examine(namespace):
    """Yields the findings on this computer and on the robot in `namespace`, such as '/robot3/'."""
    master = Peer(os.environ.get('ROS_MASTER_URI', ''))
    system_state = master.ask('getSystemState')
    if master.uri and master.problem == 'malformed':
        yield judge_master(master)    # all further checks need the address of the master
        return
    computer = this_computer(master.address)
    yield judge_address(computer)
    yield judge_master(master)
    yield from judge_programs(master.uri)
    if system_state is None:
        return
    graph = RobotGraph(namespace, system_state)
    robot_peers = _peers_of(master, graph.robot_nodes)
    publishers = _peers_of(master, graph.cmd_vel_publishers)
    yield judge_robot(graph)
    yield from judge_names(graph)
    if robot_peers:
        yield judge_nodes(robot_peers)
    live_peers = {node: peer for node, peer in robot_peers.items() if not peer.problem}
    if not live_peers:
        return

    yield from _check_return_path(computer, graph, live_peers, publishers)
    is_wall_time = not Peer(master.uri).ask('getParam', '/use_sim_time')
    yield from examine_messages(graph, computer.outgoing_address, is_wall_time)


def _peers_of(master, nodes):
    """Call each node once. Returns {node: Peer} with the outcomes of the calls."""
    peers = {}
    for node in nodes:
        peers[node] = Peer(str(Peer(master.uri).ask('lookupNode', node) or ''))
        peers[node].ask('getPid')
    return peers


def _check_return_path(computer, graph, live_peers, publishers):
    """Yields the finding on the connection from the robot to this computer. `live_peers` is {node
    of the robot that answers: Peer}. `publishers` is {node that publishes cmd_vel: Peer}."""
    live_listeners = [node for node in graph.cmd_vel_listeners if node in live_peers]
    if not live_listeners:
        return
    robot_node = live_listeners[0]
    robot = live_peers[robot_node]
    own_publishers = {node: peer.uri for node, peer in publishers.items()
                      if _can_be_here(peer) and node not in graph.robot_nodes}
    if own_publishers:
        time.sleep(1.0)    # the robot needs this time to connect to a new publisher
    connections = robot.ask('getBusInfo')
    if connections is None:
        return

    # the direction 'i' means inbound, and a node may report another node's name as `uri`
    connected = {str(uri).rstrip('/') for _, uri, direction, *_ in connections if direction == 'i'}
    address = outgoing_address(robot.address)
    yield judge_return_path(
        own_publishers, connected, robot_node, replace(computer, outgoing_address=address),
        is_robot_elsewhere=not is_own(robot.address))


def _can_be_here(peer):
    """Returns True if a node may run on this computer, even if its name cannot be resolved."""
    return peer.problem == 'unresolved' if peer.problem else is_own(peer.address)
