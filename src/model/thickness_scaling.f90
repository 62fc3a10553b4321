!> Mass scaling through the thickness as an effect: the last of the force stage.
module thickness_scaling
  use kinds, only: wp
  use seams, only: collect, sum_groups, hand_out
  use state_store, only: state_store_t
  use assembly, only: assembly_t
  use column_scaling, only: column_directions, column_differences
  use effect, only: effect_t, instant_t
  implicit none
  private

  !> Adds to the forces what makes the lumped mass answer like the scaled one. These forces have no
  !! sum in any column and are no work: the kinetic energy of the scaled mass takes it up. At a seam
  !! each patch adds the part that it has of the mass there.
  type, extends(effect_t), public :: thickness_scaling_t
  contains
    procedure :: apply
    procedure :: carry => carry_thickness_scaling
  end type thickness_scaling_t

contains

  !> Forces -m (1 - 1/factor) times the difference of the acceleration, along the columns.
  subroutine apply(self, bodies, instant)
    class(thickness_scaling_t), intent(inout) :: self
    type(assembly_t), intent(inout) :: bodies
    type(instant_t), intent(in) :: instant
    real(wp), allocatable :: acceleration(:, :, :, :), directions(:, :, :), differences(:, :, :)
    integer :: p, k, c

    associate (parts => bodies%blank%parts, seams => bodies%blank%seams)
      do p = 1, size(parts)
        call collect(seams, p, size(parts(p)%mass), 3, parts(p)%motion%external_force)
      end do
      call sum_groups(seams, 3)
      do p = 1, size(parts)
        associate (body => parts(p), motion => parts(p)%motion)
          acceleration = motion%external_force
          call hand_out(seams, p, size(body%mass), 3, acceleration)
          do c = 1, 3
            acceleration(:, :, :, c) = (acceleration(:, :, :, c) &
                                        - motion%internal_force(:, :, :, c))/body%inertia
          end do
          directions = column_directions(motion%x)
          differences = column_differences(body%inertia, directions, acceleration)
          do k = 1, size(body%mass, 3)
            differences(:, :, k) = differences(:, :, k)*body%mass(:, :, k) &
                                   *(1.0_wp - 1.0_wp/body%column_factor)
          end do
          do c = 1, 3
            do k = 1, size(body%mass, 3)
              motion%external_force(:, :, k, c) = motion%external_force(:, :, k, c) &
                                                  - directions(:, :, c)*differences(:, :, k)
            end do
          end do
        end associate
      end do
    end associate
  end subroutine apply

  !> It carries nothing.
  subroutine carry_thickness_scaling(self, store)
    class(thickness_scaling_t), intent(inout) :: self
    type(state_store_t), intent(inout) :: store
  end subroutine carry_thickness_scaling

end module thickness_scaling
