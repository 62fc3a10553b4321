!> Processes under MPI. The program that uses it is `igaform-mpi`; nothing else needs MPI.
module mpi_ranks
  use mpi_f08, only: mpi_init_thread, mpi_finalize, mpi_abort, mpi_comm_rank, mpi_comm_size, &
                     mpi_allgatherv, mpi_gatherv, mpi_bcast, mpi_allreduce, mpi_barrier, &
                     mpi_get_processor_name, mpi_comm_world, mpi_double_precision, mpi_integer, &
                     mpi_character, mpi_max, mpi_thread_funneled, mpi_max_processor_name, &
                     mpi_isend, mpi_recv, mpi_probe, mpi_get_count, mpi_waitall, mpi_request, &
                     mpi_status, mpi_status_ignore, mpi_statuses_ignore
  use kinds, only: wp
  use ranks, only: ranks_t
  use parcel, only: parcel_t, empty_parcel
  implicit none
  private

  public :: begin_mpi, end_mpi

  !> All processes that `mpirun` has started.
  type, extends(ranks_t), public :: mpi_ranks_t
  contains
    procedure :: gather
    procedure :: pass
    procedure :: share
    procedure :: share_text
    procedure :: largest
    procedure :: wait
    procedure :: host
    procedure :: give_up
  end type mpi_ranks_t

contains

  !> To be called once, before anything else of this module.
  subroutine begin_mpi(ranks)
    class(mpi_ranks_t), intent(inout) :: ranks
    integer :: provided

    ! One thread of each process calls MPI, while the others of it may work.
    call mpi_init_thread(mpi_thread_funneled, provided)
    call mpi_comm_rank(mpi_comm_world, ranks%number)
    call mpi_comm_size(mpi_comm_world, ranks%n)
  end subroutine begin_mpi

  !> The orderly end, when all processes have come to theirs.
  subroutine end_mpi()
    call mpi_finalize()
  end subroutine end_mpi

  subroutine gather(self, counts, own, joined, is_everywhere)
    class(mpi_ranks_t), intent(in) :: self
    integer, intent(in) :: counts(:)
    real(wp), intent(in), contiguous :: own(:)
    real(wp), intent(inout), contiguous :: joined(:)
    logical, intent(in) :: is_everywhere
    integer :: places(self%n), r

    places(1) = 0
    do r = 2, self%n
      places(r) = places(r - 1) + counts(r - 1)
    end do
    associate (n => counts(self%number + 1))
      if (is_everywhere) then
        call mpi_allgatherv(own, n, mpi_double_precision, joined, counts, places, &
                            mpi_double_precision, mpi_comm_world)
      else
        call mpi_gatherv(own, n, mpi_double_precision, joined, counts, places, &
                         mpi_double_precision, 0, mpi_comm_world)
      end if
    end associate
  end subroutine gather

  subroutine pass(self, partners, sent, received)
    class(mpi_ranks_t), intent(in) :: self
    integer, intent(in) :: partners(:)
    type(parcel_t), intent(in), asynchronous :: sent(:)
    type(parcel_t), intent(inout) :: received(:)
    type(mpi_request) :: requests(size(partners))
    type(mpi_status) :: status
    integer :: i, n

    do i = 1, size(partners)
      call mpi_isend(sent(i)%values, sent(i)%n, mpi_double_precision, partners(i), 0, &
                     mpi_comm_world, requests(i))
    end do
    do i = 1, size(partners)
      call mpi_probe(partners(i), 0, mpi_comm_world, status)
      call mpi_get_count(status, mpi_double_precision, n)
      call empty_parcel(received(i), n)
      call mpi_recv(received(i)%values, n, mpi_double_precision, partners(i), 0, mpi_comm_world, &
                    mpi_status_ignore)
      received(i)%n = n
    end do
    call mpi_waitall(size(partners), requests, mpi_statuses_ignore)
  end subroutine pass

  subroutine share(self, values, from)
    class(mpi_ranks_t), intent(in) :: self
    real(wp), intent(inout), contiguous :: values(:)
    integer, intent(in) :: from

    call mpi_bcast(values, size(values), mpi_double_precision, from, mpi_comm_world)
  end subroutine share

  subroutine share_text(self, text, from)
    class(mpi_ranks_t), intent(in) :: self
    character(:), allocatable, intent(inout) :: text
    integer, intent(in) :: from
    integer :: n

    n = 0
    if (self%number == from) n = len(text)
    call mpi_bcast(n, 1, mpi_integer, from, mpi_comm_world)
    if (self%number /= from) text = repeat(" ", n)
    call mpi_bcast(text, n, mpi_character, from, mpi_comm_world)
  end subroutine share_text

  integer function largest(self, value)
    class(mpi_ranks_t), intent(in) :: self
    integer, intent(in) :: value

    call mpi_allreduce(value, largest, 1, mpi_integer, mpi_max, mpi_comm_world)
  end function largest

  subroutine wait(self)
    class(mpi_ranks_t), intent(in) :: self

    call mpi_barrier(mpi_comm_world)
  end subroutine wait

  function host(self) result(name)
    class(mpi_ranks_t), intent(in) :: self
    character(:), allocatable :: name
    character(mpi_max_processor_name) :: room
    integer :: n

    call mpi_get_processor_name(room, n)
    name = room(:n)
  end function host

  subroutine give_up(self, code)
    class(mpi_ranks_t), intent(in) :: self
    integer, intent(in) :: code

    call mpi_abort(mpi_comm_world, code)
  end subroutine give_up

end module mpi_ranks
