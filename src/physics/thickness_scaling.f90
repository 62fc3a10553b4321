!> Mass scaling through the thickness as an effect: the last of the force stage.
module thickness_scaling
  use kinds, only: wp
  use patch_seams, only: seams_t, collect, sum_groups, distribute
  use row_shares, only: gather_rows
  use state_store, only: state_store_t, carry, carry_array
  use element, only: element_t
  use blank, only: assembly_t
  use thickness_masses, only: column_directions, column_differences, held_column_lag
  use effect, only: effect_t, instant_t
  implicit none
  private

  !> A column that supports hold in part.
  type, public :: held_column_t
    integer :: part = 0                         !! its patch
    integer :: at(2) = 0                        !! its place along axes 1 and 2
    logical, allocatable :: is_held(:, :)       !! components of its points, shape (n3, 3)
  end type held_column_t

  !> Adds to the forces what makes the lumped mass answer like the scaled one. These forces have no
  !! sum in any column and are no work: the kinetic energy of the scaled mass takes it up. At a seam
  !! each patch adds the part that it has of the mass there.
  type, extends(effect_t), public :: thickness_scaling_t
    type(held_column_t), allocatable :: held(:)
    !> Velocities of the points of these columns in the step before, one behind the other.
    real(wp), allocatable :: before(:)
    logical :: has_before = .false.
  contains
    procedure :: apply
    procedure :: carry => carry_thickness_scaling
    procedure, nopass :: rank => rank_of_scaling
    procedure :: is_by_rows
    procedure :: join_rows
  end type thickness_scaling_t

contains

  !> Last of all forces, for it weighs their sum.
  pure integer function rank_of_scaling() result(rank)
    rank = 1
  end function rank_of_scaling

  !> Forces -m (1 - 1/factor) times the difference of the acceleration, along the columns. None
  !! where forces balance.
  subroutine apply(self, bodies, instant)
    class(thickness_scaling_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    integer :: p, n2

    if (instant%is_static) return
    associate (parts => bodies%blank%parts, seams => bodies%blank%seams)
      do p = 1, size(parts)
        associate (force => parts(p)%element%motion%external_force)
          call collect(seams, p, size(force)/3, 3, force)
        end associate
      end do
      call sum_groups(seams, 3)
      do p = 1, size(parts)
        associate (rows => parts(p)%element%motion%rows)
          n2 = size(parts(p)%element%mass, 2)
          call scale_rows(self, p, seams, instant%dt, max(1, rows%first), min(n2, rows%last), &
                          parts(p)%element)
        end associate
      end do
    end associate
    self%has_before = .true.
  end subroutine apply

  !> Some rows of columns of a patch.
  subroutine scale_rows(self, part, seams, dt, first, last, body)
    class(thickness_scaling_t), intent(inout) :: self
    integer, intent(in) :: part, first, last       !! where there are seams, all rows
    type(seams_t), intent(inout) :: seams
    real(wp), intent(in) :: dt                     !! of the last step [time]
    class(element_t), intent(inout) :: body
    real(wp), allocatable :: acceleration(:, :, :, :), directions(:, :, :), lags(:, :, :)
    integer :: k, c

    associate (motion => body%motion, inertia => body%inertia(:, first:last, :), &
               force => body%motion%external_force(:, first:last, :, :))
      acceleration = force
      if (seams%n_groups > 0) call distribute(seams, part, size(body%mass), 3, acceleration)
      do c = 1, 3
        acceleration(:, :, :, c) = (acceleration(:, :, :, c) &
                                    - motion%internal_force(:, first:last, :, c))/inertia
      end do
      directions = column_directions(motion%x(:, first:last, :, :))
      lags = column_differences(inertia, directions, acceleration)
      do k = 1, size(lags, 3)
        lags(:, :, k) = lags(:, :, k)*(1.0_wp - 1.0_wp/body%column_factor(:, first:last))
      end do
      call set_held_lags(self, part, body, first, directions, dt, acceleration, lags)
      do c = 1, 3
        do k = 1, size(lags, 3)
          force(:, :, k, c) = force(:, :, k, c) - directions(:, :, c)*body%mass(:, first:last, k) &
                                                  *lags(:, :, k)
        end do
      end do
    end associate
  end subroutine scale_rows

  !> Columns of a patch that supports hold in part. What these hold moves on as it did in the step
  !! behind: the supports themselves have their say later.
  subroutine set_held_lags(self, part, body, first_row, directions, dt, acceleration, lags)
    class(thickness_scaling_t), intent(inout) :: self
    integer, intent(in) :: part, first_row                 !! of the rows in what follows
    class(element_t), intent(in) :: body
    real(wp), intent(in) :: directions(:, :, :), dt        !! see `column_directions`; last step
    real(wp), intent(inout) :: acceleration(:, :, :, :)    !! that forces give the lumped mass
    real(wp), intent(inout) :: lags(:, :, :)
    integer :: n, first, last, row

    last = 0
    do n = 1, size(self%held)
      associate (column => self%held(n), i => self%held(n)%at(1), j => self%held(n)%at(2))
        first = last + 1
        last = last + size(column%is_held)
        row = j - first_row + 1
        if (column%part /= part .or. row < 1 .or. row > size(lags, 2)) cycle
        associate (v => body%motion%v(i, j, :, :), a => acceleration(i, row, :, :))
          where (column%is_held) a = 0.0_wp
          if (self%has_before .and. dt > 0.0_wp) then
            where (column%is_held) a = (v - reshape(self%before(first:last), shape(v)))/dt
          end if
          self%before(first:last) = reshape(v, [size(v)])
          lags(i, row, :) = held_column_lag(body%inertia(i, j, :), directions(i, row, :), &
                                            body%column_factor(i, j), column%is_held, a)
        end associate
      end associate
    end do
  end subroutine set_held_lags

  !> A column needs no other.
  pure logical function is_by_rows(self)
    class(thickness_scaling_t), intent(in) :: self

    is_by_rows = .true.
  end function is_by_rows

  !> The velocities before of all columns.
  subroutine join_rows(self, bodies)
    class(thickness_scaling_t), intent(inout) :: self
    type(assembly_t), intent(in) :: bodies
    real(wp), allocatable :: before(:, :, :)
    integer :: n, first, last

    associate (body => bodies%blank%parts(1)%element)
      allocate (before(size(body%mass, 1), size(body%mass, 2), 3*size(body%mass, 3)), source=0.0_wp)
      last = 0
      do n = 1, size(self%held)
        first = last + 1
        last = last + size(self%held(n)%is_held)
        before(self%held(n)%at(1), self%held(n)%at(2), :) = self%before(first:last)
      end do
      call gather_rows(body%motion%rows, shape(before), before)
      last = 0
      do n = 1, size(self%held)
        first = last + 1
        last = last + size(self%held(n)%is_held)
        self%before(first:last) = before(self%held(n)%at(1), self%held(n)%at(2), :)
      end do
    end associate
  end subroutine join_rows

  subroutine carry_thickness_scaling(self, store)
    class(thickness_scaling_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store

    if (size(self%held) == 0) return
    call carry(store, "has_before", self%has_before)
    call carry_array(store, "before", size(self%before), self%before)
  end subroutine carry_thickness_scaling

end module thickness_scaling
