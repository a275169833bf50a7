"""The limits on memory, processes and files of a submission's programs."""
# Linux can only limit the memory of a single process. Therefore ResourceWatch (trial/processes.py)
# adds up the memory of all programs in a sandbox, and the memory of master, robot and check.
MAX_NODE_MEMORY_BYTES = 2 * 10 ** 9
MAX_OTHER_MEMORY_BYTES = 600 * 10 ** 6    # usually 180 MB, more if a node publishes many messages
MAX_DISK_BYTES = 300 * 10 ** 6            # the size of all files in WRITABLE_FOLDERS together
MAX_PROCESSES = 100
MAX_THREADS_AND_PROCESSES = 500     # the limit for all programs of a submission together
MAX_FILE_BYTES = 50 * 10 ** 6       # a program cannot write a larger file
#: The limit for each process. It is high, because numpy reserves 3 GB for 64 threads on 64 cores.
MAX_ADDRESS_SPACE_BYTES = 6 * 10 ** 9
LIMIT_FILES_COMMAND = ['prlimit', f'--fsize={MAX_FILE_BYTES}']
#: This command limits the master, the robot, the check, and the node in a sandbox.
LIMIT_COMMAND = LIMIT_FILES_COMMAND + [f'--as={MAX_ADDRESS_SPACE_BYTES}']
#: This command limits the memory [bytes] and the processor time [s] of the process that reads a
#: submission's files.
LIMIT_READER_COMMAND = ['prlimit', '--as=1000000000', '--cpu=30', '--core=0']
